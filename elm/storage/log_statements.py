"""The statements of the log: bringing it up to date, reading it, and keeping its consumers and definitions."""

from __future__ import annotations

from sqlalchemy import BigInteger, Select, bindparam, select

from elm.storage.recall_statements import columns
from elm.storage.tables import event, log

# The head, and whether there is something to bring in. For who may write nothing of the log there never is: it reads
# what others brought in; who may write some of it shall hear which rights are missing.
# The order of `n` finds the first row at once, also where a long inbox was just emptied and not yet vacuumed.
HEAD = """
SELECT seq, (SELECT n FROM log_inbox ORDER BY n LIMIT 1) IS NOT NULL
    AND current_setting('transaction_read_only') = 'off'
    AND (has_table_privilege('log_head'::regclass, 'UPDATE')
         OR has_table_privilege('log_inbox'::regclass, 'INSERT, DELETE')
         OR has_table_privilege('log'::regclass, 'INSERT')
         OR has_table_privilege('consumer'::regclass, 'INSERT, UPDATE'))
FROM log_head
"""

# First the lock, then the rows in a statement of its own, whose snapshot has all that whoever held the lock
# before left behind. A part is committed before its whole is written, so its row has the smaller `n`, and any
# snapshot that has the whole's row has the part's.
LOCK_HEAD = "SELECT seq FROM log_head FOR UPDATE"

SEQUENCE = """
WITH moved AS (
    DELETE FROM log_inbox
    WHERE n <= (SELECT max(n) FROM (SELECT n FROM log_inbox ORDER BY n LIMIT %(most)s) first)
    RETURNING n, event_id, kind, agent, deadline, at
), entered AS (
    INSERT INTO log (seq, event_id, kind, agent, deadline, at)
    SELECT h.seq + row_number() OVER (ORDER BY m.n), m.event_id, m.kind, m.agent, m.deadline, m.at
    FROM moved m, log_head h
    ORDER BY m.n
)
UPDATE log_head SET seq = seq + (SELECT count(*) FROM moved)
RETURNING seq, (SELECT count(*) FROM moved)
"""

WRITE = """
INSERT INTO log_inbox (kind, agent, deadline, at)
SELECT kind, agent, deadline, %(now)s
FROM unnest(%(kinds)s::smallint[], %(agents)s::text[], %(deadlines)s::timestamptz[])
     WITH ORDINALITY AS tick (kind, agent, deadline, place)
ORDER BY place
"""

CONSUMERS = "SELECT name, position, checkpoint, state, report, updated_at FROM consumer"
CONSUMERS_BY_NAME = f"{CONSUMERS} ORDER BY name"
CONSUMER = f"{CONSUMERS} WHERE name = %(name)s"
# States may be large, and are read as far as they are asked for.
PROGRESS = "SELECT name, position, report, updated_at FROM consumer ORDER BY name"

REGISTER = """
INSERT INTO consumer (name, position, checkpoint, state, report, updated_at)
SELECT %(name)s, %(position)s, %(position)s, NULL, '{}', %(now)s FROM log_head WHERE seq >= %(position)s
ON CONFLICT (name) DO NOTHING
"""

# The head only grows: seen anywhere behind `position` it stays there.
ADVANCE = """
UPDATE consumer SET position = %(position)s, report = %(report)s, updated_at = %(now)s
WHERE name = %(name)s AND position = %(before)s AND %(position)s <= (SELECT seq FROM log_head)
"""

ADVANCE_CHECKPOINT = """
UPDATE consumer
SET position = %(position)s, checkpoint = %(position)s, state = %(state)s, report = %(report)s, updated_at = %(now)s
WHERE name = %(name)s AND position = %(before)s AND %(position)s <= (SELECT seq FROM log_head)
"""

REWIND = """
UPDATE consumer SET position = %(position)s, checkpoint = %(position)s, state = NULL, updated_at = %(now)s
WHERE name = %(name)s AND %(position)s <= (SELECT seq FROM log_head)
"""

REMOVE = "DELETE FROM consumer WHERE name = %(name)s"

DEFINITIONS = "SELECT name, fingerprint FROM definition ORDER BY name"

DEFINE = """
INSERT INTO definition (name, fingerprint) SELECT * FROM unnest(%(names)s::text[], %(fingerprints)s::text[])
ON CONFLICT (name) DO NOTHING
"""

# Of the sender only, as a transaction of its own that waits for no disk: in the transaction of a commit it would
# have all writers take turns until theirs is on disk.
NOTIFY = "SELECT set_config('synchronous_commit', 'off', true), pg_notify($1, '')"

TRY_LOCK = "SELECT pg_try_advisory_lock(%s)"
UNLOCK = "SELECT pg_advisory_unlock(%s)"


def read() -> Select[tuple[object, ...]]:
    """A page of entries, each as `columns` of its event, if it has one, then its own five."""
    after, limit = bindparam("after", type_=BigInteger), bindparam("limit", type_=BigInteger)
    page = select(log).where(log.c.seq > after).order_by(log.c.seq).limit(limit).subquery("page")
    own = (page.c.seq, page.c.kind, page.c.agent, page.c.deadline, page.c.at)
    found = page.outerjoin(event, event.c.id == page.c.event_id)
    return select(*columns(event), *own).select_from(found).order_by(page.c.seq)
