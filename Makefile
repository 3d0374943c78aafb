PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
PORT   ?= 8000
# Half of the time of the slowest tests is waiting for processes: one worker more than cores keeps all of them at work.
WORKERS ?= $(shell cores=$$(getconf _NPROCESSORS_ONLN 2>/dev/null || echo 2); echo $$((cores < 3 ? cores + 1 : 4)))
VALIDATIONS := wires calibration multi_position diagnosis allan noise foreign_noise inspection conditioning whole_turns response alignment without_bench thermal thermometers dwells imports misfit access absence document pdf_a certificates acceptance wires_campaign wires_thermal wires_response
FOREIGN := basil edie instro ixcom moto visa
LONG_BENCHMARKS := $(addprefix tests.benchmarks.,growth lists analysis_workers large_bags)
BENCHMARKS := tests.benchmarks $(addprefix tests.benchmarks.,wires allan static thermal thermal_cycle queue queueserver campaign listeners formats previews)

# A shell that asks for no bytecode would have each of the suite's some hundred processes compile the product anew.
export PYTHONDONTWRITEBYTECODE :=

COMPILE = $(BIN)/uv pip compile --quiet --python-version 3.11 --universal --generate-hashes --no-emit-index-url --no-header

.DEFAULT_GOAL := help
.PHONY: help run test browser screenshots figures clients bench bench-long bench-against profile mutants chaos soak format check validate rights references pictures newest-form lock audit images clean foreign

help:  ## this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | expand -t 16

$(VENV)/.ready: requirements.lock pyproject.toml
	@$(PYTHON) .preflight.py
	@echo "installing the packages of requirements.lock into $(VENV): some minutes where they are downloaded"
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@test -x $(BIN)/uv || $(BIN)/python -m pip install --quiet --disable-pip-version-check uv
	@VIRTUAL_ENV=$(CURDIR)/$(VENV) $(BIN)/uv pip install --quiet --compile-bytecode --require-hashes -r requirements.lock
	@VIRTUAL_ENV=$(CURDIR)/$(VENV) $(BIN)/uv pip install --quiet --no-deps --no-build-isolation -e .
	@touch $@

run: $(VENV)/.ready  ## calibrate and verify the simulated unit, then keep serving (ONCE=1: end with the verdict)
	@$(BIN)/bench demo --port $(PORT) $(if $(ONCE),--once)

test: $(VENV)/.ready  ## the whole test suite, in WORKERS processes (one more than cores, at most 4)
	@$(BIN)/python -m pytest -n $(WORKERS) --dist worksteal --durations=40 --durations-min=1

$(VENV)/.browser: .ci/browser.lock $(VENV)/.ready
	@VIRTUAL_ENV=$(CURDIR)/$(VENV) $(BIN)/uv pip install --quiet --require-hashes -r .ci/browser.lock
	@touch $@

browser: $(VENV)/.browser  ## the pages in a real Chromium, installed first where it is missing
	@$(BIN)/python -m tests.browser.chromium; case $$? in 0) ;; 3) exit 0;; *) exit 1;; esac; \
	$(BIN)/python -m pytest tests/browser --browser -n 2 --dist loadfile

screenshots: $(VENV)/.browser  ## take the pictures of the pages in docs/pictures/pages anew
	@$(BIN)/python -m pytest -p no:xdist tests/browser/test_pictures.py --browser --pictures docs/pictures/pages

figures: $(VENV)/.browser  ## measure the pages in Chromium: stop, first paint, live charts over MINUTES (20), the feed
	@$(BIN)/python -m tests.browser.figures --minutes $(or $(MINUTES),20)

chaos: $(VENV)/.ready  ## kill the service's processes 200 times over a campaign, on SQLite and on Postgres, and check the books; suspend a supervisor; press stop while something is in its way; WIRES=1: faults and kills on a bench of drivers instead
	@kept=0; $(if $(WIRES), \
	$(BIN)/python -m tests.soak.wires --minutes $(or $(MINUTES),15) --kill-s 90 || kept=1; $(BIN)/python -m tests.chaos.kills_over_wires || kept=1, \
	$(BIN)/python -m tests.chaos --kills 200 --seed 1 --database both || kept=1; $(BIN)/python -m tests.chaos.silent_supervisor || kept=1; $(BIN)/python -m tests.chaos.stop_matrix --runs 5 || kept=1); exit $$kept

soak: $(VENV)/.ready  ## mixed load for MINUTES (60): memory, descriptors, threads and logs must stay level; WIRES=1: drivers at served simulators, with a fault a minute
	@$(BIN)/python -m tests.soak$(if $(WIRES),.wires) --minutes $(or $(MINUTES),60)

format: $(VENV)/.ready  ## format the code, put imports in order, mend what ruff can mend safely
	@$(BIN)/ruff check --fix-only --quiet . ; $(BIN)/ruff format --quiet .

check: $(VENV)/.ready  ## format, lint, types, import contracts
	@$(BIN)/ruff format --check . && $(BIN)/ruff check . && $(BIN)/lint-imports --no-cache && $(BIN)/basedpyright

validate: $(VENV)/.ready .foreign/verapdf/.ready  ## Monte Carlo against theory over 1000 simulated units and more
	@held=0; for part in $(VALIDATIONS); do echo "== $$part"; $(BIN)/python -m tests.validation.$$part || held=1; done; \
	ALL_FORMS=1 $(BIN)/python -m pytest -q -n 2 tests/storage/test_upgrades.py || held=1; exit $$held

bench: $(VENV)/.ready  ## budgets, measured and printed beside their limits
	@kept=0; for part in $(BENCHMARKS); do $(BIN)/python -m $$part || kept=1; done; exit $$kept

bench-long: $(VENV)/.ready  ## growth of cost with size, lists over 10^5 jobs and 10^6 recordings, workers of analyses, bags of 2 GB; an hour
	@kept=0; for part in $(LONG_BENCHMARKS); do echo "== $$part"; $(BIN)/python -m $$part || kept=1; done; exit $$kept

bench-against: $(VENV)/.ready  ## this checkout beside revision REV (e36ea0a), built beside it, in turns; ONLY=static,allan ROUNDS=5
	@$(BIN)/python -m tests.benchmarks.against --rev $(or $(REV),e36ea0a) --rounds $(or $(ROUNDS),5) $(if $(ONLY),--only $(ONLY))

.venv-profile/.ready: .ci/profile.lock $(VENV)/.ready
	@test -x .venv-profile/bin/python || $(PYTHON) -m venv .venv-profile
	@VIRTUAL_ENV=$(CURDIR)/.venv-profile $(BIN)/uv pip install --quiet --require-hashes -r .ci/profile.lock
	@touch $@

profile: .venv-profile/.ready  ## the three heaviest lines of each benchmark, by time and by memory; ONLY=static,allan
	@$(BIN)/python -m tests.benchmarks.heaviest --tools .venv-profile/bin $(if $(ONLY),--only $(ONLY))

.venv-mutants/.ready: .ci/mutants.lock $(VENV)/.ready
	@test -x .venv-mutants/bin/python || $(PYTHON) -m venv .venv-mutants
	@VIRTUAL_ENV=$(CURDIR)/.venv-mutants $(BIN)/uv pip install --quiet --require-hashes -r .ci/mutants.lock
	@touch $@

mutants: .venv-mutants/.ready  ## put small defects into supervisor, safety, queue, lease, retries and numerics: do the tests see them? ONLY=lease MUTANTS=15
	@nice -n 19 $(BIN)/python -m tests.mutants --tools .venv-mutants/bin --mutants $(or $(MUTANTS),15) $(if $(ONLY),--only $(ONLY))

lock: $(VENV)/.ready  ## compile requirements.lock anew, with its part for run time and the tools of the audit
	@$(COMPILE) --extra dev --extra formats pyproject.toml -o requirements.lock
	@$(COMPILE) --extra formats -c requirements.lock pyproject.toml -o .ci/runtime.lock
	@$(COMPILE) --extra dev --extra formats --extra browser -c requirements.lock pyproject.toml -o .ci/browser.lock
	@$(COMPILE) .ci/audit.in -o .ci/audit.lock
	@$(COMPILE) -c requirements.lock .ci/profile.in -o .ci/profile.lock
	@$(COMPILE) -c requirements.lock .ci/mutants.in -o .ci/mutants.lock

.venv-audit/.ready: .ci/audit.lock $(VENV)/.ready
	@test -x .venv-audit/bin/python || $(PYTHON) -m venv .venv-audit
	@VIRTUAL_ENV=$(CURDIR)/.venv-audit $(BIN)/uv pip install --quiet --require-hashes -r .ci/audit.lock
	@touch $@

audit: .venv-audit/.ready  ## licences and bill of materials into build/, and known vulnerabilities where an index answers
	@$(BIN)/python .ci/audit.py --tools .venv-audit/bin

images: $(VENV)/.ready  ## pin the images of docker-compose.yml by digest and build, where a container engine is
	@$(BIN)/python .ci/images.py

clients: $(VENV)/.ready  ## lint the OpenAPI document, generate clients from it, drive a service with the generated one
	@$(BIN)/python -m tests.clients

references: $(VENV)/.ready  ## write docs/results.md, campaign-document.md and citations.md anew, from schemas and docstrings
	@$(BIN)/python -m tests.kit.reference_pages
	@$(BIN)/python -m tests.kit.citations_page

rights: $(VENV)/.ready  ## write docs/rights.md anew, from the routes and their rights
	@$(BIN)/python -m tests.kit.rights_page

pictures: $(VENV)/.ready  ## draw the layers of docs/architecture.md anew, from the import contracts
	@$(BIN)/python -m tests.kit.layer_picture


newest-form: $(VENV)/.ready  ## write migrations/newest_form.sql anew, after a new migration
	@$(BIN)/python -m tests.kit.newest_form

foreign: $(addprefix .foreign/,$(addsuffix /.ready,$(FOREIGN)))  ## environments of the programs by others that the tests talk to

.foreign/%/.ready: tests/foreign/%.lock | $(VENV)/.ready
	@test -x $(BIN)/uv || $(BIN)/python -m pip install --quiet --disable-pip-version-check uv
	@test -x .foreign/$*/bin/python || $(PYTHON) -m venv --without-pip .foreign/$*
	@VIRTUAL_ENV=$(CURDIR)/.foreign/$* $(BIN)/uv pip install --quiet --require-hashes -r $<
	@touch $@

clean:  ## remove the environment and the demo's data
	rm -rf $(VENV) .venv-audit .venv-profile .venv-mutants .foreign .bench
