SELECT event.id
FROM event
WHERE (event.feature_names @> %(p0)s::TEXT[]) AND (EXISTS (SELECT 1
FROM json_array_elements(event.features) AS anon_1(value)
WHERE CASE WHEN ((anon_1.value ->> 0) = %(p1)s::VARCHAR AND json_typeof(anon_1.value -> 1) = 'boolean') THEN ((anon_1.value ->> 1) COLLATE "C") != %(p2)s::VARCHAR ELSE false END)) ORDER BY lower(event.period), event.id
