SELECT event.id, event.uid, event.type_id, event.period, event.frame_id, event.region AS region, event.subject_frame_id, event.subject AS subject, event.features, event.agent, event.media_type, event.payload, event.parts, array((SELECT up.whole_uid
FROM part AS up
WHERE up.part_id = event.id ORDER BY up.whole_id)) AS wholes, event.recorded_at
FROM event
WHERE event.type_id = %(p0)s::INTEGER ORDER BY lower(event.period), event.id
 LIMIT %(limit)s::BIGINT
