# The C library for other people's package tools: archives, and the estimator as two files. docs/PACKAGES.md.

.PHONY: amalgamation packages
amalgamation: ## the estimator as bslam.h and bslam.c; out/amalgamation
	@$(PYTHON) -m tools.packaging.amalgamate

packages: ## archives for Arduino, PlatformIO, ESP-IDF, and the amalgamation; out/packages
	@$(PYTHON) -m tools.packaging.packages
