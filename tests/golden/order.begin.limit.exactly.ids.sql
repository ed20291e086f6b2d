SELECT event.id
FROM event
WHERE event.type_id = %(p0)s::INTEGER ORDER BY lower(event.period), event.id
 LIMIT %(limit)s::BIGINT
