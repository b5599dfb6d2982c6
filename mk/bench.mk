# What a filter step costs, in instructions as callgrind counts them on the host: unlike time, the same from
# run to run. Instructions are not cycles. tests/bench/bench_step.c is the step, bench.py counts it, and
# runs other people's programs beside it, as far as they are installed.

.PHONY: bench
bench: ## a step's instructions (valgrind); time, memory, error beside MRPT, Eigen, GTSAM, LIBLINEAR (5 min)
	@tools/setup.sh bench
	@$(PYTHON) -m tools.bench.bench

.PHONY: bench-doc
bench-doc: ## the same, written into docs/BENCHMARKS.md
	@tools/setup.sh bench
	@$(PYTHON) -m tools.bench.bench --out docs

.PHONY: bench-pictures
bench-pictures: ## find objects beside OpenCV's HOG, a small network and AprilTag: PICTURES="DIR DIR"
	@tools/setup.sh bench
	@$(PYTHON) -m tools.bench.peers.pictures $(PICTURES)
