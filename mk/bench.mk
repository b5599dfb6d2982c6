# What a filter step costs, in instructions as callgrind counts them on the host: unlike time, the same from
# run to run. Instructions are not cycles. tests/bench/bench_step.c is the step, tools/bench.py counts it.

.PHONY: bench
bench: ## count the instructions of a filter step at several map sizes (valgrind)
	@tools/setup.sh bench
	@$(PYTHON) tools/bench.py

.PHONY: bench-vision
bench-vision: ## count the instructions a pixel of the vision front end (valgrind); renders what it looks at
	@tools/setup.sh bench
	@$(PYTHON) tools/bench_vision.py

.PHONY: bench-learner
bench-learner: ## count the instructions of learning on the robot (valgrind); renders what is learned first
	@tools/setup.sh bench
	@$(PYTHON) tools/bench_learner.py
