# Parts of the documents that are generated, so that they cannot lag behind the code.

.PHONY: docs
docs: setup-run ## write the generated parts of docs/TUNING.md: presets and settings
	@$(PYTHON) -m tools.checks.params_doc --into docs/TUNING.md
