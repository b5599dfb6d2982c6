# What a filter step costs, in instructions as callgrind counts them on the host: unlike time, the same from
# run to run. Instructions are not cycles. tests/bench/bench_step.c is the step, tools/bench.py counts it.

.PHONY: bench
bench: ## count the instructions of a filter step at several map sizes (valgrind)
	@tools/setup.sh bench
	@$(PYTHON) tools/bench.py
