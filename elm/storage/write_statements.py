"""The statements that write: each commits one event with its links and log entry, or one level of many."""

from __future__ import annotations

from elm.storage.encoding import COLUMNS
from elm.storage.tables import LOG_CLOSE, LOG_COMMIT, LOG_OPEN

# What derives from the parts (Defs 7 and 10). The corners are collected, not the areas united: a union
# would change the hull's last digits. In uid order, so that every store finds the same ones.
_EXTENT = """
    range_merge(range_agg(p.period)) AS period,
    CASE WHEN min(p.frame_id) = max(p.frame_id) THEN min(p.frame_id) END AS frame_id,
    CASE WHEN min(p.frame_id) = max(p.frame_id) THEN ST_ConvexHull(ST_Collect(p.region ORDER BY p.uid)) END AS region,
    CASE WHEN min(p.subject_frame_id) = max(p.subject_frame_id) THEN min(p.subject_frame_id) END AS subject_frame_id,
    CASE WHEN min(p.subject_frame_id) = max(p.subject_frame_id)
         THEN ST_ConvexHull(ST_Collect(p.subject ORDER BY p.uid)) END AS subject,
    CASE WHEN count(p.agent) = count(*) AND min(p.agent) = max(p.agent) THEN min(p.agent) END AS agent
"""


# That extents given for a complex event are those that derive, as `geometry.same_extent` says.
_AGREES = """
    (<given>period IS NULL OR <given>period = x.period)
    AND (<given>frame_id IS NULL OR (<given>frame_id = x.frame_id
         AND ST_HausdorffDistance(<given>region, x.region) <= 1e-6) IS TRUE)
    AND (<given>subject_frame_id IS NULL OR (<given>subject_frame_id = x.subject_frame_id
         AND ST_HausdorffDistance(<given>subject, x.subject) <= 1e-6) IS TRUE)
"""


# The log says whether an event was open when it came: read again after it closed, it must tell the same.
_KIND = f"CASE WHEN is_open THEN {LOG_OPEN} ELSE {LOG_COMMIT} END"


def _filled(statement: str) -> str:
    """`statement` with the pieces that several share put in: all of them constants of this module."""
    return (
        statement.replace("<columns>", ", ".join(COLUMNS))
        .replace("<extent>", _EXTENT)
        .replace("<agrees g.>", _AGREES.replace("<given>", "g."))
        .replace("<agrees s.>", _AGREES.replace("<given>", "s."))
        .replace("<kind>", _KIND)
        .replace("<$1 not forgotten>", _NOT_FORGOTTEN.format(uid="$1"))
        .replace("<staged not forgotten>", _NOT_FORGOTTEN.format(uid="staging.uid"))
        .replace("<s not forgotten>", _NOT_FORGOTTEN.format(uid="s.uid"))
        .replace("<tombstones>", _TOMBSTONES)
        .replace("<close>", str(LOG_CLOSE))
    )


# A constant to the planner until the memory gets its first tombstone (docs/adr/0010): it costs nothing before.
_NOT_FORGOTTEN = "(nothing_forgotten() OR NOT EXISTS (SELECT FROM tombstone WHERE tombstone.uid = {uid}))"


# Of an event beside its tombstone (docs/adr/0010 says when there is one) the event counts.
_TOMBSTONES = """SELECT id, uid, period, frame_id, region, subject_frame_id, subject, agent FROM tombstone
        WHERE NOT EXISTS (SELECT FROM event WHERE event.uid = tombstone.uid)"""


# Parameters $1 to $17 are `encoding.COLUMNS` in their order, $18 the time of writing.

# An event in one round trip. A uid that is taken comes back only where the content is the same: the
# update changes nothing, but unlike DO NOTHING it returns the row, also of a transaction just finished.
COMMIT_ATOMIC = _filled("""
WITH new AS (
    INSERT INTO event (<columns>)
    SELECT $1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, $12, $13, $14, $15, $16, $17 WHERE <$1 not forgotten>
    ON CONFLICT (uid) DO UPDATE SET uid = excluded.uid WHERE event.content = excluded.content
    RETURNING id, upper_inf(period) AS is_open, xmax <> 0 AS existed
), logged AS (
    INSERT INTO log_inbox (event_id, kind, agent, at) SELECT id, <kind>, $11, $18 FROM new WHERE NOT existed
)
SELECT id, existed FROM new
""")

# A complex event in one round trip. FOR SHARE waits for a part that is just being closed and then reads
# its end; without it two parts closed meanwhile would leave the whole open for ever. In id order, as
# close locks too, so that the two never wait for each other.
COMMIT_COMPLEX = _filled("""
WITH g AS (
    SELECT $3::tstzrange AS period, $4::integer AS frame_id, $5::geometry AS region,
           $6::integer AS subject_frame_id, $7::geometry AS subject
), p AS MATERIALIZED (
    SELECT id, uid, period, frame_id, region, subject_frame_id, subject, agent
    FROM event WHERE uid = ANY($14::uuid[]) ORDER BY id FOR SHARE
), x AS (
    SELECT count(*) AS found, <extent> FROM p
), new AS (
    INSERT INTO event (<columns>)
    SELECT $1, $2, x.period, x.frame_id, x.region, x.subject_frame_id, x.subject, $8, $9, $10,
           coalesce($11, x.agent), $12, $13, $14, $15, $16, $17
    FROM x, g
    WHERE x.found = cardinality($14) AND <agrees g.> AND <$1 not forgotten>
    ON CONFLICT (uid) DO UPDATE SET uid = excluded.uid WHERE event.content = excluded.content
    RETURNING id, uid, agent, upper_inf(period) AS is_open, xmax <> 0 AS existed
), linked AS (
    INSERT INTO part (whole_id, part_id, ordinal, whole_uid)
    SELECT new.id, p.id, asked.ordinal, new.uid
    FROM new, unnest($14) WITH ORDINALITY AS asked (uid, ordinal) JOIN p USING (uid)
    WHERE NOT existed
), logged AS (
    INSERT INTO log_inbox (event_id, kind, agent, at) SELECT id, <kind>, agent, $18 FROM new WHERE NOT existed
)
SELECT id, existed FROM new
""")

# The same where some of the parts are tombstones, which are locked as well: none goes while a whole of it comes.
COMMIT_OVER_TOMBSTONES = COMMIT_COMPLEX.replace("p AS MATERIALIZED (", "there AS MATERIALIZED (").replace(
    "), x AS (",
    _filled("""), forgotten AS MATERIALIZED (
    <tombstones> AND uid = ANY($14::uuid[]) ORDER BY id FOR SHARE
), p AS MATERIALIZED (
    SELECT * FROM there UNION ALL SELECT * FROM forgotten
), x AS ("""),
)

# Many events: copied into a temporary table, they go from there level by level, for a statement does not see the
# rows it inserts itself. Of a load, the atomic ones are copied into the table itself. All have their ids before, and
# enter the log at the end: both in the order in which they were given, whatever their level.

RESERVE_IDS = """
SELECT nextval((SELECT pg_get_serial_sequence('event', 'id')::regclass)) FROM generate_series(1, %s)
"""

# Of the forgotten that still count as parts no content is known.
CONTENTS = """
SELECT uid, content FROM event WHERE uid = ANY(%(uids)s)
UNION ALL SELECT uid, NULL FROM tombstone WHERE uid = ANY(%(uids)s) AND NOT nothing_forgotten()
"""

COPY_EVENTS = _filled("COPY event (id, <columns>) FROM STDIN (FORMAT BINARY)")

COPY_LOG = "COPY log_inbox (event_id, kind, agent, at) FROM STDIN (FORMAT BINARY)"

CREATE_STAGING = """
CREATE TEMPORARY TABLE IF NOT EXISTS staging (
    id bigint NOT NULL, level integer NOT NULL, uid uuid, type_id integer, period tstzrange, frame_id integer,
    region geometry, subject_frame_id integer, subject geometry, feature_tokens text[], feature_names text[],
    features json, agent text, media_type text, payload bytea, parts uuid[], recorded_at timestamptz, content bytea,
    feature_ends bigint
) ON COMMIT DELETE ROWS
"""

COPY_STAGING = "COPY staging FROM STDIN (FORMAT BINARY)"

# What `COMMIT_ATOMIC` does but for the log, for all staged events without parts.
COMMIT_STAGED = _filled("""
INSERT INTO event (id, <columns>) OVERRIDING SYSTEM VALUE
SELECT id, <columns> FROM staging WHERE level = 0 AND <staged not forgotten> ORDER BY id
ON CONFLICT (uid) DO UPDATE SET uid = excluded.uid WHERE event.content = excluded.content
RETURNING id, uid, xmax <> 0 AS existed, upper_inf(period) AS is_open, agent
""")

# Only of parts that were there before: those of the same transaction nobody else can close or forget.
LOCK_PARTS = "SELECT id FROM event WHERE uid = ANY(%(uids)s) ORDER BY id FOR SHARE"

# In a statement of its own, which sees what became of parts while their locks were waited for.
LOCK_FORGOTTEN_PARTS = """
SELECT id FROM tombstone WHERE uid = ANY(%(uids)s) AND NOT nothing_forgotten() ORDER BY id FOR SHARE
"""

_LEVEL = _filled("""
WITH p AS MATERIALIZED (
    SELECT s.id AS whole_id, asked.ordinal, e.id, e.uid, e.period, e.frame_id, e.region, e.subject_frame_id,
           e.subject, e.agent
    FROM staging s, unnest(s.parts) WITH ORDINALITY AS asked (uid, ordinal) JOIN event e ON e.uid = asked.uid
    WHERE s.level = %(level)s
), x AS (
    SELECT p.whole_id, count(*) AS found, <extent> FROM p GROUP BY p.whole_id
), new AS (
    INSERT INTO event (id, <columns>) OVERRIDING SYSTEM VALUE
    SELECT s.id, s.uid, s.type_id, x.period, x.frame_id, x.region, x.subject_frame_id, x.subject, s.feature_tokens,
           s.feature_names, s.features, coalesce(s.agent, x.agent), s.media_type, s.payload, s.parts,
           s.recorded_at, s.content, s.feature_ends
    FROM staging s JOIN x ON x.whole_id = s.id
    WHERE s.level = %(level)s AND x.found = cardinality(s.parts) AND <agrees s.> AND <s not forgotten>
    ORDER BY s.id
    <conflict>
    RETURNING id, uid, xmax <> 0 AS existed, upper_inf(period) AS is_open, agent
), linked AS (
    INSERT INTO part (whole_id, part_id, ordinal, whole_uid)
    SELECT new.id, p.id, p.ordinal, new.uid
    FROM new JOIN p ON p.whole_id = new.id
    WHERE NOT existed
)
SELECT id, uid, existed, is_open, agent FROM new
""")

# A load knows which uids are taken, and begins anew when others take one meanwhile.
LOAD_LEVEL = _LEVEL.replace("<conflict>", "")
# What `COMMIT_COMPLEX` does but for the log, for one level of staged events.
COMMIT_LEVEL = _LEVEL.replace(
    "<conflict>",
    "ON CONFLICT (uid) DO UPDATE SET uid = excluded.uid WHERE event.content = excluded.content",
)

# The same where some of the parts are tombstones.
_ALSO_TOMBSTONES = _filled("""JOIN (
        SELECT id, uid, period, frame_id, region, subject_frame_id, subject, agent FROM event
        UNION ALL <tombstones>
    ) e ON e.uid = asked.uid""")
LOAD_LEVEL_OVER_TOMBSTONES = LOAD_LEVEL.replace("JOIN event e ON e.uid = asked.uid", _ALSO_TOMBSTONES)
COMMIT_LEVEL_OVER_TOMBSTONES = COMMIT_LEVEL.replace("JOIN event e ON e.uid = asked.uid", _ALSO_TOMBSTONES)

# Not only statistics: what was loaded is marked as seen by all, so that links are read from their index alone, and
# what still waits to enter the inverted indexes enters them. It costs a quarter more, and spares each recall pages.
TIDY = "VACUUM (ANALYZE) event, part, event_type, type_closure, log_inbox"

# Closing: the event first; then, each in later statements that see what others committed meanwhile, its wholes
# and theirs, the smallest id next. Parts have smaller ids than their wholes: so each is recomputed after all below
# it, and locked in the order in which all writers lock. Only of a locked whole is it certain which wholes it has:
# whoever commits one more locks its parts first.

CLOSE_EVENT = """
UPDATE event SET period = tstzrange(lower(period), %(end)s, '[]')
WHERE uid = %(uid)s AND upper_inf(period) AND parts = '{}' AND lower(period) <= %(end)s
RETURNING id, agent
"""

WHOLES_OF = "SELECT whole_id FROM part WHERE part_id = %(id)s"

LOCK_WHOLE = "SELECT uid, upper_inf(period) AS was_open FROM event WHERE id = %(id)s FOR UPDATE"

RECOMPUTE_WHOLE = """
UPDATE event SET period = (
    SELECT range_merge(range_agg(p.period)) FROM (
        SELECT e.period FROM part l JOIN event e ON e.id = l.part_id WHERE l.whole_id = event.id
        UNION ALL
        SELECT t.period FROM part l JOIN tombstone t ON t.id = l.part_id
        WHERE l.whole_id = event.id AND NOT nothing_forgotten()
    ) p
)
WHERE id = %(id)s
RETURNING upper_inf(period), agent, ARRAY(SELECT whole_id FROM part WHERE part_id = event.id)
"""

LOG_CLOSED = _filled("INSERT INTO log_inbox (event_id, kind, agent, at) VALUES (%(id)s, <close>, %(agent)s, %(now)s)")
