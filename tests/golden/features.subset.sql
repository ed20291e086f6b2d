SELECT event.id
FROM event
WHERE (event.feature_tokens <@ %(p0)s::TEXT[]) IS true AND event.feature_ends = ANY (%(p1)s::BIGINT[]) ORDER BY lower(event.period), event.id
