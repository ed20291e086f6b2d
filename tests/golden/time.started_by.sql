SELECT event.id
FROM event
WHERE lower(event.period) = %(p0)s::TIMESTAMP WITH TIME ZONE AND coalesce(upper(event.period), 'infinity'::timestamptz) > %(p1)s::TIMESTAMP WITH TIME ZONE ORDER BY lower(event.period), event.id
