"""Tests of recognizers: patterns against an enumeration of all that they might find."""
