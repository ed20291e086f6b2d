"""The index on whole sets of feature names has their sizes in front: what holds a set is among the larger ones."""

from __future__ import annotations

from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None

STATEMENTS = (
    "DROP INDEX event_feature_names_set_idx",
    """
    CREATE INDEX event_feature_names_set_idx ON event (
        (hash_array(feature_names) + (cardinality(feature_names)::bigint << 32))
    )
    """,
    # Without statistics on it, the planner would not know that few events have larger sets.
    "ANALYZE event",
)


def upgrade() -> None:
    for statement in STATEMENTS:
        op.execute(statement)
