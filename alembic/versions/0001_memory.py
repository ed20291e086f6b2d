"""The tables of a memory: types and their closure, frames, events, parts, and the inbox of the log."""

from __future__ import annotations

from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None

STATEMENTS = (
    """
    CREATE TABLE event_type (
        id integer GENERATED ALWAYS AS IDENTITY,
        name text COLLATE "C" NOT NULL,
        CONSTRAINT event_type_pkey PRIMARY KEY (id),
        CONSTRAINT event_type_name_key UNIQUE (name)
    )
    """,
    """
    CREATE TABLE type_parent (
        child_id integer NOT NULL,
        parent_id integer NOT NULL,
        CONSTRAINT type_parent_pkey PRIMARY KEY (child_id, parent_id),
        CONSTRAINT type_parent_not_own_parent_check CHECK (child_id <> parent_id),
        CONSTRAINT type_parent_child_id_fkey FOREIGN KEY (child_id) REFERENCES event_type (id),
        CONSTRAINT type_parent_parent_id_fkey FOREIGN KEY (parent_id) REFERENCES event_type (id)
    )
    """,
    """
    CREATE TABLE type_closure (
        ancestor_id integer NOT NULL,
        descendant_id integer NOT NULL,
        CONSTRAINT type_closure_pkey PRIMARY KEY (ancestor_id, descendant_id)
    )
    """,
    "CREATE INDEX type_closure_descendant_id_idx ON type_closure (descendant_id)",
    """
    CREATE TABLE frame (
        id integer GENERATED ALWAYS AS IDENTITY,
        name text COLLATE "C" NOT NULL,
        CONSTRAINT frame_pkey PRIMARY KEY (id),
        CONSTRAINT frame_name_key UNIQUE (name)
    )
    """,
    """
    CREATE TABLE event (
        id bigint GENERATED ALWAYS AS IDENTITY,
        uid uuid NOT NULL,
        type_id integer NOT NULL,
        period tstzrange NOT NULL,
        frame_id integer,
        region geometry(POLYGON, 0),
        subject_frame_id integer,
        subject geometry(POLYGON, 0),
        feature_tokens text[] COLLATE "C" NOT NULL,
        feature_names text[] COLLATE "C" NOT NULL,
        features json NOT NULL,
        agent text COLLATE "C",
        media_type text COLLATE "C",
        payload bytea,
        parts uuid[] NOT NULL,
        recorded_at timestamptz NOT NULL,
        content bytea NOT NULL,
        feature_ends bigint NOT NULL,
        CONSTRAINT event_pkey PRIMARY KEY (id),
        CONSTRAINT event_uid_key UNIQUE (uid),
        CONSTRAINT event_whole_check CHECK (
            lower_inc(period) AND (upper_inc(period) OR upper_inf(period)) AND NOT lower_inf(period)
            AND (region IS NULL) = (frame_id IS NULL) AND (subject IS NULL) = (subject_frame_id IS NULL)
            AND (payload IS NULL) = (media_type IS NULL)
        )
    )
    """,
    "CREATE INDEX event_begin_id_idx ON event (lower(period), id)",
    "CREATE INDEX event_type_id_begin_id_idx ON event (type_id, lower(period), id)",
    "CREATE INDEX event_period_idx ON event USING gist (period)",
    "CREATE INDEX event_region_idx ON event USING gist (frame_id, region)",
    "CREATE INDEX event_subject_idx ON event USING gist (subject_frame_id, subject) WHERE subject IS NOT NULL",
    """
    CREATE INDEX event_feature_tokens_idx ON event USING gin (feature_tokens)
    WITH (gin_pending_list_limit = 64)
    """,
    """
    CREATE INDEX event_feature_names_idx ON event USING gin (feature_names)
    WITH (gin_pending_list_limit = 64)
    """,
    "CREATE INDEX event_feature_ends_idx ON event (feature_ends)",
    "CREATE INDEX event_payload_idx ON event (sha256(payload)) WHERE payload IS NOT NULL",
    "CREATE INDEX event_agent_idx ON event (agent) WHERE agent IS NOT NULL",
    "CREATE INDEX event_recorded_at_idx ON event (recorded_at)",
    """
    CREATE TABLE part (
        whole_id bigint NOT NULL,
        part_id bigint NOT NULL,
        ordinal integer NOT NULL,
        whole_uid uuid NOT NULL,
        CONSTRAINT part_pkey PRIMARY KEY (whole_id, part_id),
        CONSTRAINT part_part_before_whole_check CHECK (part_id < whole_id),
        CONSTRAINT part_whole_id_fkey FOREIGN KEY (whole_id) REFERENCES event (id),
        CONSTRAINT part_part_id_fkey FOREIGN KEY (part_id) REFERENCES event (id)
    )
    """,
    "CREATE INDEX part_part_id_idx ON part (part_id, whole_id) INCLUDE (whole_uid)",
    """
    CREATE TABLE log_inbox (
        n bigint GENERATED ALWAYS AS IDENTITY,
        event_id bigint,
        kind smallint NOT NULL,
        agent text COLLATE "C",
        deadline timestamptz,
        at timestamptz NOT NULL,
        CONSTRAINT log_inbox_pkey PRIMARY KEY (n)
    )
    """,
)


def upgrade() -> None:
    for statement in STATEMENTS:
        op.execute(statement)
