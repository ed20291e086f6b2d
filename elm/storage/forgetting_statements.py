"""The statements of forgetting: a batch of events goes, tombstones come, and what tombstones a memory has."""

from __future__ import annotations

from elm.storage.tables import HULL_OF_REGIONS, HULL_OF_SUBJECTS

# One batch, in one transaction: first the locks, in the order in which all writers lock; then each step in a
# statement of its own, whose snapshot has the links that others wrote while they held the locks.

# One forgetting at a time: of a whole and its part that went at once, each would leave the other's trace behind.
TAKE_TURNS = "LOCK TABLE forgetting IN SHARE ROW EXCLUSIVE MODE"

# A whole that is being written locks its parts: it is there when this goes on, or finds its part gone.
LOCK_EVENTS = "SELECT id, upper_inf(period) FROM event WHERE id = ANY(%(ids)s) ORDER BY id FOR UPDATE"

# Tombstones that may have lost their last whole.
LOCK_TOMBSTONES = """
SELECT id FROM tombstone WHERE id IN (SELECT part_id FROM part WHERE whole_id = ANY(%(ids)s)) ORDER BY id FOR UPDATE
"""

UNLINK = "DELETE FROM part WHERE whole_id = ANY(%(ids)s)"

STILL_PARTS = "SELECT DISTINCT part_id FROM part WHERE part_id = ANY(%(ids)s)"

# An event beside its tombstone (docs/adr/0010 says when there is one): the wholes of both have one part again.
JOIN_TWINS = """
WITH twin AS (
    SELECT e.id AS event_id, t.id AS tombstone_id, least(e.id, t.id) AS first
    FROM event e JOIN tombstone t USING (uid) WHERE e.id = ANY(%(ids)s)
), linked AS (
    UPDATE part SET part_id = first FROM twin WHERE part_id IN (event_id, tombstone_id) AND part_id <> first
)
UPDATE tombstone SET id = first FROM twin WHERE id = tombstone_id AND id <> first
"""

BURY = """
INSERT INTO tombstone (id, uid, period, frame_id, region, subject_frame_id, subject, agent, run)
SELECT id, uid, period, frame_id, region, subject_frame_id, subject, agent, %(run)s FROM event WHERE id = ANY(%(ids)s)
ON CONFLICT (uid) DO NOTHING
"""

# What is left of the rest: of events that no whole has, and of tombstones that none has any more.
_GONE = """
    SELECT period, frame_id, region, subject_frame_id, subject FROM event WHERE id = ANY(%(ids)s)
    UNION ALL
    SELECT period, frame_id, region, subject_frame_id, subject FROM tombstone WHERE id = ANY(%(dissolved)s)
"""

COUNT_IN = f"""
INSERT INTO forgetting (run, at, events, period)
SELECT %(run)s, %(at)s, count(*), range_merge(range_agg(period)) FROM ({_GONE}) gone
ON CONFLICT (run) DO UPDATE SET events = forgetting.events + excluded.events,
    period = coalesce(range_merge(forgetting.period, excluded.period), forgetting.period, excluded.period)
"""  # noqa: S608 - the pieces are constants of this module

PLACE_IN = f"""
WITH gone AS ({_GONE}), place AS (
    SELECT {HULL_OF_REGIONS} AS kind, frame_id, region AS place FROM gone WHERE region IS NOT NULL
    UNION ALL
    SELECT {HULL_OF_SUBJECTS}, subject_frame_id, subject FROM gone WHERE subject IS NOT NULL
)
INSERT INTO forgetting_place (run, kind, frame_id, hull)
SELECT %(run)s, kind, frame_id, ST_ConvexHull(ST_Collect(place)) FROM place GROUP BY kind, frame_id
ON CONFLICT (run, kind, frame_id) DO UPDATE
SET hull = ST_ConvexHull(ST_Collect(forgetting_place.hull, excluded.hull))
"""  # noqa: S608 - the pieces are constants of this module

# Sizes as they are stored: a long payload is not read for that.
_BYTES = """
    pg_column_size(features) + pg_column_size(feature_tokens) + pg_column_size(feature_names) + pg_column_size(parts)
    + coalesce(pg_column_size(region), 0) + coalesce(pg_column_size(subject), 0)
    + coalesce(pg_column_size(payload), 0) + 200
"""

TALLY = f"""
SELECT type_id, count(*), sum({_BYTES})::bigint FROM event WHERE id = ANY(%(ids)s) GROUP BY type_id
"""  # noqa: S608 - the pieces are constants of this module

REMOVE_EVENTS = "DELETE FROM event WHERE id = ANY(%(ids)s)"

DISSOLVE = "DELETE FROM tombstone WHERE id = ANY(%(ids)s)"

# The same without doing it: each line is (type, events, bytes, tombstones, still open, dissolved).
WOULD_FORGET = f"""
WITH going AS MATERIALIZED (
    SELECT e.id, e.type_id, {_BYTES} AS bytes, upper_inf(e.period) AS is_open
    FROM event e JOIN unnest(%(ids)s::bigint[]) AS asked (id) ON e.id = asked.id
), gone AS MATERIALIZED (
    SELECT id FROM going WHERE NOT is_open
), kept AS MATERIALIZED (
    SELECT DISTINCT l.part_id AS id FROM part l JOIN gone ON gone.id = l.part_id
    WHERE NOT EXISTS (SELECT FROM gone above WHERE above.id = l.whole_id)
), dissolved AS (
    SELECT t.id FROM tombstone t
    WHERE t.id IN (SELECT l.part_id FROM part l JOIN gone ON gone.id = l.whole_id)
      AND NOT EXISTS (
          SELECT FROM part l WHERE l.part_id = t.id AND NOT EXISTS (SELECT FROM gone above WHERE above.id = l.whole_id)
      )
)
SELECT type_id, count(*) FILTER (WHERE NOT is_open), coalesce(sum(bytes) FILTER (WHERE NOT is_open), 0)::bigint,
       count(kept.id), count(*) FILTER (WHERE is_open), (SELECT count(*) FROM dissolved)
FROM going LEFT JOIN kept ON kept.id = going.id
GROUP BY type_id
"""  # noqa: S608 - the pieces are constants of this module

# Before the first tombstone ever: from now on statements look for tombstones. Plans in which this was a constant
# are made anew; whoever is still running one holds the lock on `event` that is waited for then. That it was waited
# for stands at the function: others who forget meanwhile, or after one who was killed, wait as well.
IS_PRISTINE = "SELECT nothing_forgotten()"
LOCK_PRISTINE = "SELECT pg_advisory_xact_lock(%s)"
END_PRISTINE = "CREATE OR REPLACE FUNCTION nothing_forgotten() RETURNS boolean LANGUAGE sql IMMUTABLE AS 'SELECT false'"
WAIT_FOR_WRITERS = "LOCK TABLE event IN SHARE MODE"
ADMITS_TOMBSTONES = "SELECT obj_description('nothing_forgotten()'::regprocedure, 'pg_proc') IS NOT NULL"
ADMIT_TOMBSTONES = "COMMENT ON FUNCTION nothing_forgotten() IS 'all writers look for tombstones'"

# Reading

_TOMBSTONES = """
SELECT id, uid, lower(period), upper(period), frame_id, region, subject_frame_id, subject, agent, run FROM tombstone
"""
TOMBSTONES = f"{_TOMBSTONES} ORDER BY id"
TOMBSTONES_OF = f"{_TOMBSTONES} WHERE uid = ANY(%(uids)s) ORDER BY id"
FORGOTTEN_AMONG = "SELECT uid FROM tombstone WHERE uid = ANY(%(uids)s) AND NOT nothing_forgotten()"

RUNS = "SELECT run, at, events, lower(period), upper(period) FROM forgetting ORDER BY at, run"
RUNS_OF = "SELECT run, at, events, lower(period), upper(period) FROM forgetting WHERE run = ANY(%(runs)s)"
COUNT_RUNS = "SELECT count(*), coalesce(sum(events), 0)::bigint FROM forgetting"
PLACES = "SELECT run, kind, frame_id, hull FROM forgetting_place WHERE run = ANY(%(runs)s)"

# Keeping what another memory has

# Events that are there hinder their tombstones: locked, so that they are not forgotten meanwhile.
EVENTS_AMONG = "SELECT uid FROM event WHERE uid = ANY(%(uids)s) ORDER BY id FOR KEY SHARE"

KEEP_TOMBSTONE = """
INSERT INTO tombstone (id, uid, period, frame_id, region, subject_frame_id, subject, agent, run)
SELECT nextval((SELECT pg_get_serial_sequence('event', 'id')::regclass)), %(uid)s, tstzrange(%(begin)s, %(end)s, '[]'),
       %(frame)s, ST_GeomFromWKB(%(region)s::bytea), %(subject_frame)s, ST_GeomFromWKB(%(subject)s::bytea), %(agent)s,
       %(run)s
ON CONFLICT (uid) DO NOTHING
"""

KEEP_RUN = """
INSERT INTO forgetting (run, at, events, period)
VALUES (%(run)s, %(at)s, %(events)s,
        CASE WHEN %(begin)s::timestamptz IS NOT NULL THEN tstzrange(%(begin)s, %(end)s, '[]') END)
ON CONFLICT (run) DO NOTHING
"""

KEEP_PLACE = """
INSERT INTO forgetting_place (run, kind, frame_id, hull)
VALUES (%(run)s, %(kind)s, %(frame)s, ST_GeomFromWKB(%(hull)s::bytea))
"""
