# Parts of the documents that are generated, so that they cannot lag behind the code.

.PHONY: docs
docs: setup-run ## write the generated parts of docs/: the table of parameters
	@$(PYTHON) -m tools.checks.params_doc --into docs/API.md
