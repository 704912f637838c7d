# Everything below sets itself up: it needs Python 3.11 or later, make, and the package registry.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
NODE := tests/pages/node_modules/.bin
INSTALLED := $(VENV)/.installed
# One process a processor; a file's tests stay together, as they share what they set up. What pytest
# makes of the files is kept, whatever the environment says: it takes each process some seconds.
PYTEST := PYTHONDONTWRITEBYTECODE= $(BIN)/pytest -n logical --maxprocesses 8 --dist loadfile
TIMES := --durations=25 --durations-min=5

.PHONY: help demo test test-all room lint scripts quick all digests rooms bench gallery figures \
	outputs schemas site frozen release clean

help:  ## what there is to make
	@sed -n 's/^\([a-z-]*\):[^#]*## \(.*\)/make \1	\2/p' $(MAKEFILE_LIST) | expand -t 16

demo: $(INSTALLED)  ## run the main job on a built-in shape and say where to look
	$(BIN)/fabweave make "shape:torus?m=24&n=12" --size 400mm --pattern twill \
	  --sheet 600x400mm -o out/torus
	@echo
	@echo "Look at: out/torus/index.html, which leads to all the others:"
	@echo "  out/torus/render.png            the torus in 2/2 twill, woven of 24 ribbons"
	@echo "  out/torus/sheets/sheet_01.png   the first sheet; .dxf and .svg beside it go to the laser"
	@echo "  out/torus/waste.html            what becomes of the material"
	@echo "  out/torus/model.glb             the woven object, for any 3-D viewer"
	@echo "  out/torus/assembly.html         how to put it together: strips, sheets and steps in 3-D"
	@echo "  out/torus/crossing_map.csv      what crosses what"
	@echo "  out/torus/verify.json           what was proved about these files"
	@echo
	@echo "Next: $(BIN)/fabweave inspect YOUR_MESH tells what can be woven on a mesh of your own"

test: lint quick  ## install, lint, type-check, and run the tests that are quick: some minutes

test-all: lint all  ## the same with all tests: what a change has to pass in the end

room: $(INSTALLED)  ## run all tests of one room: make room ROOM=piece
	$(PYTEST) $(TIMES) tests/$(or $(ROOM),$(error say which room: make room ROOM=piece))

lint: $(INSTALLED)  ## check style and types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/mypy --platform win32
	@$(MAKE) --no-print-directory scripts

scripts:  ## check style and types of the pages' scripts, where npm is there
	@if ! command -v npm >/dev/null; then echo "npm is not there: the pages' scripts are not checked"; \
	elif ! npm install --prefix tests/pages --no-package-lock --no-audit --no-fund --silent; then \
	  echo "npm could not fetch what checks them: the pages' scripts are not checked"; \
	else $(NODE)/tsc -p tests/pages && \
	  $(NODE)/oxlint -c tests/pages/.oxlintrc.json --ignore-pattern '**/three.js' fabweave; fi

quick: $(INSTALLED)
	$(PYTEST) -m "not slow" --hypothesis-profile=glance

all: $(INSTALLED)
	$(PYTEST) $(TIMES)

digests: $(INSTALLED)  ## make small jobs of every kind and print a digest of each file, to compare
	$(BIN)/python tests/tools/job_digests.py

rooms: $(INSTALLED)  ## print which room imports from which
	$(BIN)/python tests/tools/import_table.py

gallery: $(INSTALLED)  ## make the gallery's pictures and page, and the notebook, anew: some minutes
	$(BIN)/python examples/make_gallery.py examples/gallery
	$(BIN)/python examples/make_notebook.py examples/fabweave.ipynb

figures: $(INSTALLED)  ## make the page of the paper's figures anew: some minutes
	$(BIN)/python examples/make_figures.py examples/figures --page

outputs: $(INSTALLED)  ## make the finished jobs in outputs anew: some minutes
	$(BIN)/python tests/tools/make_outputs.py outputs

schemas: $(INSTALLED)  ## write the schemas of crossing_map.json and job.toml anew
	$(BIN)/python tests/tools/make_schemas.py

site: $(INSTALLED)  ## build the site of guide, gallery, finished jobs and reference into out/site
	$(BIN)/python -m pip install --quiet -e ".[site]"
	$(BIN)/python tests/tools/make_site.py out/site

frozen: $(INSTALLED)  ## freeze the program, with all that it needs, into the folder dist/fabweave
	$(BIN)/python -m pip install --quiet pyinstaller
	$(BIN)/pyinstaller --noconfirm --clean --name fabweave --workpath build --specpath build \
	  $(addprefix --collect-all ,fabweave ezdxf trimesh reportlab igl pyQuadriFlow \
	  pynanoinstantmeshes pygel3d manifold3d) $(addprefix --exclude-module ,matplotlib PySide6 \
	  PyQt5 PyQt6 tkinter IPython pytest) fabweave/__main__.py

release: $(INSTALLED)  ## build wheel and sdist into dist, the same twice, and check them for an index
	$(BIN)/python tests/tools/make_release.py dist

bench: $(INSTALLED)  ## print times, memory, ratios; BEFORE=COMMIT: beside those of a commit
	for script in tests/benchmarks/bench_*.py; do $(BIN)/python $$script || exit 1; done

$(INSTALLED): pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet -e ".[dev]"
	touch $@

clean:  ## remove what was installed and built
	rm -rf $(VENV) tests/pages/node_modules build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis
