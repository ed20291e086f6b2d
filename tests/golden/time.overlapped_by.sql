SELECT event.id
FROM event
WHERE (event.period && tstzrange(%(p1)s::TIMESTAMP WITH TIME ZONE, %(p1)s::TIMESTAMP WITH TIME ZONE, '[]')) AND %(p0)s::TIMESTAMP WITH TIME ZONE < lower(event.period) AND lower(event.period) < %(p1)s::TIMESTAMP WITH TIME ZONE AND %(p1)s::TIMESTAMP WITH TIME ZONE < coalesce(upper(event.period), 'infinity'::timestamptz) ORDER BY lower(event.period), event.id
