"""The log: its entries in order, where it ends, its consumers, and the definitions that have been at work."""

from __future__ import annotations

from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None

STATEMENTS = (
    """
    CREATE TABLE log_head (
        id smallint NOT NULL,
        seq bigint NOT NULL,
        CONSTRAINT log_head_pkey PRIMARY KEY (id),
        CONSTRAINT log_head_one_row_check CHECK (id = 1)
    )
    """,
    "INSERT INTO log_head (id, seq) VALUES (1, 0)",
    """
    CREATE TABLE log (
        seq bigint NOT NULL,
        event_id bigint,
        kind smallint NOT NULL,
        agent text COLLATE "C",
        deadline timestamptz,
        at timestamptz NOT NULL,
        CONSTRAINT log_pkey PRIMARY KEY (seq)
    )
    """,
    """
    CREATE TABLE consumer (
        name text COLLATE "C" NOT NULL,
        position bigint NOT NULL,
        checkpoint bigint NOT NULL,
        state bytea,
        report json NOT NULL,
        updated_at timestamptz NOT NULL,
        CONSTRAINT consumer_pkey PRIMARY KEY (name)
    )
    """,
    """
    CREATE TABLE definition (
        name text COLLATE "C" NOT NULL,
        fingerprint text COLLATE "C" NOT NULL,
        CONSTRAINT definition_pkey PRIMARY KEY (name)
    )
    """,
    # Until now the inbox did not tell open events from ended ones: open were those that were closed later, and
    # those that still are.
    """
    UPDATE log_inbox SET kind = 3
    WHERE kind = 1 AND (
        event_id IN (SELECT event_id FROM log_inbox WHERE kind = 2)
        OR event_id IN (SELECT id FROM event WHERE upper_inf(period))
    )
    """,
)


def upgrade() -> None:
    for statement in STATEMENTS:
        op.execute(statement)
