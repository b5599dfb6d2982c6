# Parts of the documents that are generated, so that they cannot lag behind the code.

.PHONY: docs
docs: setup-run ## write the generated parts of docs/: the table of parameters
	@$(PYTHON) tools/params_doc.py --into docs/API.md
