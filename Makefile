# `make demo` and `make test` do all set-up themselves: see scripts/setup.
SHELL := /bin/bash
.DEFAULT_GOAL := help
.PHONY: help setup demo test test-slow lint opponents bench paper report clean

help:  ## show these targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

setup:  ## .venv with the development tools, PostgreSQL with PostGIS from the system's packages
	@scripts/setup

demo: setup  ## fill a memory with half an hour of a real robot's life and ask it questions; then ArmarX's memory
	@mkdir -p out
	@for memory in mower kitchen; do .venv/bin/elm migrate --memory $$memory >/dev/null; done
	@.venv/bin/elm demo --picture out/plaza.png
	@.venv/bin/elm armem demo

test: setup  ## all tests but the slow ones; in containers too where a Docker engine is at hand
	@$$ELM_DOCKER_WRAPPER .venv/bin/python -m pytest -m "not slow" --numprocesses auto --maxprocesses 4 --dist loadfile

test-slow: setup  ## long fuzzing and memories of 10^6 events
	@$$ELM_DOCKER_WRAPPER .venv/bin/python -m pytest -m slow --numprocesses auto --maxprocesses 4 --dist loadfile

lint: setup  ## ruff and mypy --strict
	@.venv/bin/ruff check
	@.venv/bin/ruff format --check
	@.venv/bin/mypy

opponents: setup  ## the stores and engines that elm is compared with, each in an environment of its own
	@scripts/opponents

bench: setup  ## measure inserts, recalls, recognition, type hierarchies and growth; the figures go to out/
	@mkdir -p out
	.venv/bin/python -m simulators insert --json out/insert.json
	.venv/bin/python -m simulators recall --json out/recall.json
	.venv/bin/python -m simulators recognize --json out/recognize.json
	.venv/bin/python -m simulators types --json out/types.json
	.venv/bin/python -m simulators scale --json out/scale.json
	.venv/bin/python -m simulators report

paper: setup  ## the paper's experiments, ten runs each: three hours; goes on where it was stopped
	@mkdir -p out
	.venv/bin/python -m simulators paper --json out/paper.json

report: setup  ## out/report/report.md, with plots, of all figures in out/
	.venv/bin/python -m simulators report

clean:  ## remove what these targets made in the checkout
	rm -rf .venv .opponents .mypy_cache .ruff_cache .pytest_cache .hypothesis build dist out
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
