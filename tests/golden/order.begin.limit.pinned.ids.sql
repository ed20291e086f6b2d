SELECT event.id
FROM event
WHERE event.uid = ANY (%(p0)s::UUID[]) ORDER BY lower(event.period), event.id
 LIMIT %(limit)s::BIGINT
