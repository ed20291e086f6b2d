SELECT event.id
FROM event
WHERE event.id = ANY (array((SELECT part.whole_id
FROM part JOIN event AS other ON other.id = part.part_id
WHERE other.uid = %(p1)s::UUID))) AND (event.parts @> %(p0)s::UUID[]) ORDER BY lower(event.period), event.id
