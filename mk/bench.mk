# What a filter step costs, in instructions as callgrind counts them on the host: unlike time, the same from
# run to run. Instructions are not cycles. tests/bench/bench_<name>.c is a program that drives the core.

BENCH_SOURCES := $(sort $(wildcard tests/bench/bench_*.c))
BENCH_PROGRAMS := $(BENCH_SOURCES:tests/bench/%.c=build/bench/%)

# The calls that are counted, one line of output each.
BENCH_FUNCTIONS := bslam_slam_odometry bslam_slam_sightings

.PHONY: bench
bench: setup-bench ## count the instructions of the core's main calls (valgrind)
	@$(MAKE) --no-print-directory --silent $(BENCH_PROGRAMS:%=%.count)

.PHONY: setup-bench
setup-bench:
	@tools/setup.sh bench

$(BENCH_PROGRAMS): build/bench/%: tests/bench/%.c $(CORE_SOURCES) $(CORE_HEADERS) mk/config.mk mk/bench.mk
	@mkdir -p $(@D)
	@$(CC) $(C_STANDARD) $(C_INCLUDES) $(C_WARNINGS) -O2 -g $< $(CORE_SOURCES) -lm -o $@

.PHONY: $(BENCH_PROGRAMS:%=%.count)
$(BENCH_PROGRAMS:%=%.count): %.count: %
	@for function in $(BENCH_FUNCTIONS); do \
	    valgrind --tool=callgrind --callgrind-out-file=/dev/null --toggle-collect=$$function $< 2>&1 >$<.log \
	    | awk -v name=$(<F) -v call=$$function '/Collected/ { count = $$4 } \
	        END { if (count == "") exit 1; printf "%s %s: %d instructions\n", name, call, count }'; \
	done
