# The site: one folder of files for any web server, or to read from the disk (then without search). It asks
# nobody else.

SITE_VENV := build/site/venv
SITE_STAMP := $(SITE_VENV)/stamp
SITE_PAGES := build/site/docs
SITE_NOTEBOOKS := build/site/notebooks
PLAYGROUND_HTML := out/playground/index.html

.PHONY: site
site: setup $(SITE_STAMP) playground ## documents, headers, notebooks, playground as a site: out/site
	@$(PYTHON) notebooks/run.py $(SITE_NOTEBOOKS)
	@$(SITE_VENV)/bin/python -m tools.site_pages $(SITE_PAGES) $(SITE_NOTEBOOKS)
	@test ! -f $(PLAYGROUND_HTML) || install -D $(PLAYGROUND_HTML) $(SITE_PAGES)/playground/index.html
	@NO_MKDOCS_2_WARNING=1 $(SITE_VENV)/bin/mkdocs --quiet build --strict
	@echo "site: open out/site/index.html"

$(SITE_STAMP): requirements-site.txt
	@python3 -m venv $(SITE_VENV)
	@$(SITE_VENV)/bin/pip install --quiet --requirement requirements-site.txt
	@touch $@

.PHONY: lint-ci
lint-ci: ## what a public CI would do, read by its linter (needs Go)
	@go run github.com/rhysd/actionlint/cmd/actionlint@v1.7.7 .github/workflows/*.yml
