SELECT event.id, NULL AS anon_1
FROM event
WHERE event.type_id BETWEEN %(p0)s::INTEGER AND %(p0)s::INTEGER AND event.type_id = %(p0)s::INTEGER ORDER BY lower(event.period), event.id
 LIMIT %(limit)s::BIGINT
