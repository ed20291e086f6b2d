SELECT event.id
FROM event
WHERE lower(event.period) = %(p1)s::TIMESTAMP WITH TIME ZONE ORDER BY lower(event.period), event.id
