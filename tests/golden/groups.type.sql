SELECT event.type_id, count(*) AS count_1, coalesce(sum(EXTRACT(epoch FROM upper(event.period) - lower(event.period)) * 1000000), 0) AS coalesce_1, min(lower(event.period)) AS min_1, max(upper(event.period)) AS max_1, bool_or(upper_inf(event.period)) AS bool_or_1
FROM event
WHERE (event.period <@ tstzrange(%(p0)s::TIMESTAMP WITH TIME ZONE, %(p1)s::TIMESTAMP WITH TIME ZONE, '[]')) AND event.type_id IN (SELECT type_closure.descendant_id
FROM type_closure
WHERE type_closure.ancestor_id = %(p2)s::INTEGER) GROUP BY event.type_id
