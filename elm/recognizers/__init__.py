"""Recognizers find complex events in the log; the room is kept for them, they come with the log's consumers."""
