SELECT event.id
FROM event
WHERE event.recorded_at < %(p0)s::TIMESTAMP WITH TIME ZONE ORDER BY lower(event.period), event.id
