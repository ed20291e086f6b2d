SELECT event.id
FROM event
WHERE (event.period && tstzrange(%(p0)s::TIMESTAMP WITH TIME ZONE, %(p0)s::TIMESTAMP WITH TIME ZONE, '[]')) AND lower(event.period) < %(p0)s::TIMESTAMP WITH TIME ZONE AND %(p0)s::TIMESTAMP WITH TIME ZONE < coalesce(upper(event.period), 'infinity'::timestamptz) AND coalesce(upper(event.period), 'infinity'::timestamptz) < %(p1)s::TIMESTAMP WITH TIME ZONE ORDER BY lower(event.period), event.id
