# Mutants: the estimator's sources, changed in one place at a time. How many of them do the unit tests notice?
# More: MUTANTS="--sample 40 --layers ekf --jobs 2".

MUTANTS :=

.PHONY: mutants
mutants: $(UNIT_PROGRAMS_plain) ## 500 changes of the estimator, one at a time: how many the unit tests notice
	@MUTANTS_CC="$(patsubst -M%,,$(UNIT_COMPILE_plain))" MUTANTS_LIBS="$(CMOCKA_LIBS) -lm" \
	    $(PYTHON) -m tools.proofs.mutants $(MUTANTS)
