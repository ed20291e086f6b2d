"""Tests of working memory: memory servers, commits, queries."""
