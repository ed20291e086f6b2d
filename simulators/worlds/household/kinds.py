"""What happens in a household, as event types: what the robot does and perceives, and the routines of its days."""

from __future__ import annotations

from elm.taxonomy import EventType

_MEALS = ("Breakfast", "Lunch", "Dinner")
_HOUSEWORK = ("Tidying", "Unloading", "Cleaning", "Watering")
_OTHERS = ("Patrol", "Delivery", "Departure", "Homecoming", "Night", "StandBy")
_BELOW: dict[str, tuple[str, ...]] = {
    "Motion": ("Drive", "Turn", "Dock", "Undock"),
    "Action": ("Manipulation", "Charge", "Wait", "Look"),
    "Manipulation": ("Grasp", "Drop", "Place", "Open", "Close", "Pour", "Wipe"),
    "Interaction": ("Say",),
    "Perception": ("Seeing", "Hearing"),
    "Seeing": ("SeeObject", "SeePerson", "PersonActivity"),
    "Hearing": ("HearSound",),
    "PersonActivity": ("PersonEnters", "PersonLeaves", "PersonEats", "PersonReads", "PersonWorks"),
    "Episode": ("Day", "Routine"),
    "Routine": ("Meal", "Housework", *_OTHERS),
    "Meal": _MEALS,
    "Housework": _HOUSEWORK,
}
_SEVERAL = {
    "Carry": ("Motion", "Manipulation"),
    "HandOver": ("Manipulation", "Interaction"),
    "Receive": ("Manipulation", "Interaction"),
    "HearSpeech": ("Hearing", "Interaction"),
    "PersonTakes": ("PersonActivity", "SeeObject"),
    "PersonPuts": ("PersonActivity", "SeeObject"),
}
"""Types with two parents."""

ROOTS = ("Action", "Motion", "Interaction", "Perception", "Episode")
ROUTINES = (*_MEALS, *_HOUSEWORK, *_OTHERS)
"""The types of the complex events that are parts of a day."""
DAY = "Day"


def event_types() -> list[EventType]:
    """The hierarchy, parents first."""
    parents = {child: (parent,) for parent, children in _BELOW.items() for child in children} | _SEVERAL
    return [
        *(EventType(name=root) for root in ROOTS),
        *(EventType(name=name, parents=above) for name, above in parents.items()),
    ]
