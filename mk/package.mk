# The Python package: its files to hand on, and the hashes of what it stands on.

UV := build/lock/bin/uv
PIP_COMPILE := $(UV) pip compile --quiet --universal --python-version 3.11 --generate-hashes \
    --no-annotate --no-header

.PHONY: lock package
lock: ## write requirements*.lock.txt: the pins of requirements*.txt with hashes; after each change there
	@python3 -m venv build/lock && build/lock/bin/pip install --quiet uv==0.13.9
	@$(PIP_COMPILE) --output-file requirements.lock.txt requirements.txt
	@$(PIP_COMPILE) --output-file requirements-test.lock.txt --constraint requirements.txt requirements-test.txt

package: setup-run ## the wheel and the sdist, in dist
	@rm -rf build/lib* build/bdist* # else modules that are deleted since would be in the wheel
	@$(PYTHON) setup.py --quiet sdist --dist-dir dist bdist_wheel --dist-dir dist
	@ls -l dist
