# The playground: the estimator in a browser tab, one file without a server. clang has WebAssembly as a
# target; clang-19 is what the tests take already, lld-19 its linker: 5 MB more, where wasi-libc and
# Emscripten bring a C library of which five functions are needed (playground/libc).

# All that the host's extensions of this size have, so that fingerprints are the same.
PLAYGROUND_SIZES := -DBSLAM_REAL_DOUBLE=0 -DBSLAM_BEACONS_MAX=80 -DBSLAM_RAYS_MAX=80 \
    -DBSLAM_SIGHTINGS_MAX=96 -DBSLAM_HISTORY_MAX=128 -DBSLAM_APPEARANCE=1 -DBSLAM_SMOOTHER=1 \
    -DBSLAM_HYPOTHESES_MAX=8 -DBSLAM_GUARD=2
PLAYGROUND_COMPILE := clang-19 --target=wasm32 $(C_STANDARD) -Os -mbulk-memory -nostdlib \
    -isystem playground/libc $(C_INCLUDES) -Wall -Wextra -Werror $(PLAYGROUND_SIZES) \
    -DBSLAM_SETTING_MEANINGS=0
PLAYGROUND_C := playground/playground.c playground/libc/libc.c $(LIBRARY_SOURCES_bslam)
PLAYGROUND_PAGE := $(sort $(wildcard playground/page.html playground/*.css playground/*.js playground/*/*.js))

C_FILES += $(wildcard playground/*.c playground/libc/*.[ch])
PYTHON_DIRS += playground

.PHONY: playground
playground: out/playground/index.html ## the estimator in a browser tab: out/playground/index.html, one file
	@echo "$<: $$(wc -c < $<) bytes"

build/playground/bslam.wasm: $(PLAYGROUND_C) $(CORE_HEADERS) $(wildcard playground/libc/*.h) mk/playground.mk
	@command -v clang-19 >/dev/null && command -v wasm-ld-19 >/dev/null || { echo "playground: clang-19 and" \
	    "wasm-ld-19 make it; install them with: apt-get install clang-19 lld-19" >&2; exit 2; }
	@mkdir -p $(@D)
	@$(PLAYGROUND_COMPILE) -Wl,--no-entry,--strip-all,--gc-sections,-z,stack-size=65536 $(PLAYGROUND_C) -o $@

out/playground/index.html: build/playground/bslam.wasm playground/inline.py $(PLAYGROUND_PAGE)
	@$(PLAIN_PYTHON) playground/inline.py $< $@
