# The C library for other people's package tools: archives, and the estimator as two files. docs/PACKAGES.md.

.PHONY: amalgamation packages
amalgamation: ## the estimator as bslam.h and bslam.c; out/amalgamation
	@$(PLAIN_PYTHON) -m tools.packaging.amalgamate

packages: ## archives for Arduino, PlatformIO, ESP-IDF, and the amalgamation; out/packages
	@$(PLAIN_PYTHON) -m tools.packaging.packages

# The tools of the ecosystems, in an environment of their own: they pin much that `bslam` needs otherwise.
ECOSYSTEM_TOOLS := esp-idf-kconfig==3.14.0 idf-component-manager==3.1.2 packaging==26.3 platformio==6.2.0 \
    pykwalify==1.8.0 scons==4.11.1 west==1.5.0

.PHONY: check-packages
check-packages: packages build/ecosystems/installed ## the same by PlatformIO, compote, west, Arduino's tools
	@build/ecosystems/bin/python tests/python/packaging/ecosystems.py out/packages

build/ecosystems/installed: mk/packages.mk
	@echo "check-packages: installing into build/ecosystems: $(ECOSYSTEM_TOOLS)"
	@python3 -m venv --clear build/ecosystems
	@build/ecosystems/bin/pip install --quiet --disable-pip-version-check $(ECOSYSTEM_TOOLS)
	@touch $@
