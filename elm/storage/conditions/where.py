"""Conditions on space: a region or subject against a polygon of the same frame."""

from __future__ import annotations

from typing import Any, assert_never

from geoalchemy2 import Geometry
from sqlalchemy import ColumnElement, Double, FromClause, Integer, LargeBinary, and_, func
from sqlalchemy.types import TypeEngine

from elm.cues.algebra import RegionCue
from elm.cues.relations import Place
from elm.geometry import SpatialRelation
from elm.storage.conditions.rule import Bind, Names, Rule, SqlCondition


def region(cue: RegionCue, names: Names) -> Rule:
    """The region or subject against a polygon of one frame."""
    frame_id, geometry = ("frame_id", "region") if cue.place is Place.REGION else ("subject_frame_id", "subject")
    values: tuple[tuple[Any, TypeEngine[Any]], ...] = (
        (names.frame_id(cue.region.frame), Integer()),
        (cue.region.wkb, LargeBinary()),
    )
    if cue.distance is not None:
        values = (*values, (cue.distance, Double()))

    def build(e: FromClause, frame: Bind, wkb: Bind, *distance: Bind) -> SqlCondition:
        given = func.ST_GeomFromWKB(wkb, type_=Geometry)
        return and_(e.c[frame_id] == frame, _spatial(cue.relation, e.c[geometry], given, *distance))

    key = ("region", cue.place.value, cue.relation.value)
    # Most of a frame is disjoint from a polygon: there is no index for that.
    if cue.relation is SpatialRelation.DISJOINT:
        return Rule(key=key, values=values, build=build)

    def glimpse(e: FromClause, frame: Bind, wkb: Bind, *distance: Bind) -> SqlCondition:
        # The boxes around both: a predicate of PostGIS takes 5 us a row, and the index is not there to spare it.
        given = func.ST_GeomFromWKB(wkb, type_=Geometry)
        around = func.ST_Expand(given, *distance, type_=Geometry) if distance else given
        return e.c[geometry].op(_BOXES.get(cue.relation, "&&"), is_comparison=True)(around)

    def outline(e: FromClause, frame: Bind, *rest: Bind) -> SqlCondition:
        return and_(e.c[frame_id] == frame, glimpse(e, frame, *rest))

    return Rule(key=key, values=values, build=build, search=build, glimpse=glimpse, outline=outline, looks=(outline,))


_BOXES = {SpatialRelation.EQUAL: "~=", SpatialRelation.SUBSET: "@", SpatialRelation.SUPERSET: "~"}
"""How the boxes stand to each other where the polygons do so, unless they only touch: as PostGIS itself searches."""


def _spatial(relation: SpatialRelation, here: ColumnElement[Any], given: Any, *distance: Bind) -> Any:
    match relation:
        case SpatialRelation.EQUAL:
            return func.ST_Equals(here, given)
        case SpatialRelation.SUBSET:
            return func.ST_CoveredBy(here, given)
        case SpatialRelation.SUPERSET:
            return func.ST_Covers(here, given)
        case SpatialRelation.INTERSECTS:
            return func.ST_Intersects(here, given)
        case SpatialRelation.DISJOINT:
            return func.ST_Disjoint(here, given)
        case SpatialRelation.TOUCHES:
            return func.ST_Touches(here, given)
        case SpatialRelation.WITHIN_DISTANCE:
            return func.ST_DWithin(here, given, *distance)
        case unknown:
            assert_never(unknown)
