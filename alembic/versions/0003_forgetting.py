"""Forgetting: tombstones of single events and of each forgetting, and links to parts that are tombstones."""

from __future__ import annotations

from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None

STATEMENTS = (
    """
    CREATE TABLE tombstone (
        id bigint NOT NULL,
        uid uuid NOT NULL,
        period tstzrange NOT NULL,
        frame_id integer,
        region geometry(POLYGON, 0),
        subject_frame_id integer,
        subject geometry(POLYGON, 0),
        agent text COLLATE "C",
        run uuid NOT NULL,
        CONSTRAINT tombstone_pkey PRIMARY KEY (id),
        CONSTRAINT tombstone_uid_key UNIQUE (uid),
        CONSTRAINT tombstone_whole_check CHECK (
            lower_inc(period) AND upper_inc(period) AND NOT lower_inf(period)
            AND (region IS NULL) = (frame_id IS NULL) AND (subject IS NULL) = (subject_frame_id IS NULL)
        )
    )
    """,
    """
    CREATE TABLE forgetting (
        run uuid NOT NULL,
        at timestamptz NOT NULL,
        events bigint NOT NULL,
        period tstzrange,
        CONSTRAINT forgetting_pkey PRIMARY KEY (run)
    )
    """,
    """
    CREATE TABLE forgetting_place (
        run uuid NOT NULL,
        kind smallint NOT NULL,
        frame_id integer NOT NULL,
        hull geometry(POLYGON, 0) NOT NULL,
        CONSTRAINT forgetting_place_pkey PRIMARY KEY (run, kind, frame_id),
        CONSTRAINT forgetting_place_run_fkey FOREIGN KEY (run) REFERENCES forgetting (run)
    )
    """,
    # A part may be a tombstone now. Whoever writes links locks the parts instead.
    "ALTER TABLE part DROP CONSTRAINT part_part_id_fkey",
    # A constant to the planner: as long as there has never been a tombstone, no statement looks for one.
    "CREATE FUNCTION nothing_forgotten() RETURNS boolean LANGUAGE sql IMMUTABLE AS 'SELECT true'",
)


def upgrade() -> None:
    for statement in STATEMENTS:
        op.execute(statement)
