SELECT event.id
FROM event
WHERE event.type_id IN (SELECT type_closure.descendant_id
FROM type_closure
WHERE type_closure.ancestor_id = %(p0)s::INTEGER) ORDER BY lower(event.period), event.id
