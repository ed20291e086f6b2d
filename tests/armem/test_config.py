"""Configurations: what a file says as values, and what is refused, with file, key and remedy."""

from __future__ import annotations

from pathlib import Path

import pytest

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases import ALIASES
from armem_bridge.config import Configuration, InvalidConfiguration, Mode, read_config
from armem_bridge.forgetting import (
    PCA,
    Ebbinghaus,
    Exponential,
    Frequency,
    LatentSimilarity,
    RandomProjection,
    Retention,
    Similarity,
    TimeDecay,
)
from armem_bridge.long_term import PosePath, When
from armem_bridge.memory_id import MemoryID
from armem_bridge.profiles import PROFILES
from armem_bridge.working import MemoryServer

CUP = """<typedefinition><generatetypes>
  <object name="Cup" namespace="example::dto"><objectchild key="colour"><string/></objectchild></object>
</generatetypes></typedefinition>"""
CUPS = CUP.replace("</generatetypes>", '<object name="Mug" namespace="example::dto"/></generatetypes>')

EVERYTHING = """
[[memories]]
profile = "ObjectMemory"
history = 1000
prior_knowledge = ["classes.json"]
delay_warning = 0.25
update_bytes = 1000000

[memories.history_limits]
"Instance/ObjectLocalizer/blue%2Fcup" = 5

[[memories.core_segments]]
name = "Instance"
history = 100
poses = ["globalPose", {path = "parts[*].pose", unit = "m"}]

[[memories.core_segments]]
name = "Cup"
type = {file = "types/cup.xml", name = "::example::dto::Cup", include = ["shared"]}

[[memories]]
profile = "RobotStateMemory"
name = "Armar"
typed = false

[[memories.core_segments]]
name = "State"
type = "robot_state"

[long_term]
memory = "armar7"
dsn = "memory://"
robot = "armar7"
frame = "kitchen"
radius = 0.1
when = "on_eviction"
at_stop = false
backlog = 500
wait = 2.0

[long_term.robot_state]
segment = "Armar/State"
pose = "globalPose"
footprint = [[0.4, 0.3], [0.4, -0.3], [-0.4, -0.3], [-0.4, 0.3]]
max_age = 0.5

[forgetting.online]
time_decay = {activation = "ebbinghaus", minimum = 0.3, k = 1.5, minute = 10.0}
frequency = {wait = 0.5}
similarity = {distance = "mse", minimum = 0.01, count = 3}

[forgetting.offline]
time_decay = {tau = 60.0, minimum = 0.1}
frequency = {wait = 2.0}
similarity = {distance = "cosine", minimum = 0.1, encoder = "random_projection", size = 8, seed = 4}
retention = {count = 100, bytes = 1000, age = 3600.0, total_count = 1000, total_bytes = 10000}
keep_newest = false

[ice]
mode = "join"
slices = ["workspace", "/opt/armarx"]
locator = "IceGrid/Locator:tcp -p 4061"
own_name_system = true

[ice.properties]
"Ice.Trace.Network" = "1"
"""


@pytest.fixture
def directory(tmp_path: Path) -> Path:
    (tmp_path / "types").mkdir()
    (tmp_path / "types" / "cup.xml").write_text(CUP)
    (tmp_path / "types" / "cups.xml").write_text(CUPS)
    return tmp_path


def read(directory: Path, text: str) -> Configuration:
    file = directory / "memory.toml"
    file.write_text(text, encoding="utf-8")
    return read_config(file)


def refusal(directory: Path, text: str) -> str:
    with pytest.raises(InvalidConfiguration) as refused:
        read(directory, text)
    message = str(refused.value)
    assert message.startswith(f"{directory / 'memory.toml'}: ")
    return message.removeprefix(f"{directory / 'memory.toml'}: ")


def test_the_least_there_can_be(directory: Path) -> None:
    config = read(directory, '[[memories]]\nprofile = "ObjectMemory"\n')
    (memory,) = config.memories

    assert memory.name == "Object"
    assert list(memory.core_segments) == [each.definition() for each in PROFILES["ObjectMemory"].core_segments]
    assert (memory.limits, memory.prior_knowledge, memory.delay_threshold) == ({}, (), 1_000_000)
    assert (config.long_term, config.online, config.offline) == (None, (), ())
    assert config.ice.mode is Mode.NONE


def test_everything_there_can_be(directory: Path) -> None:
    config = read(directory, EVERYTHING)
    objects, armar = config.memories
    segments = {each.name: each.aron_type for each in objects.core_segments}

    assert (objects.name, armar.name) == ("Object", "Armar")
    assert segments["Instance"] == ALIASES["ObjectInstance"], "the profile's, for the file gives no other"
    assert segments["Cup"] == t.Object(name="example::dto::Cup", members={"colour": t.String()})
    assert list(segments)[-1] == "Cup"
    assert {str(where): limit for where, limit in objects.limits.items()} == {
        "Object": 1000,
        "Object/Instance": 100,
        "Object/Instance/ObjectLocalizer/blue%2Fcup": 5,
    }
    assert objects.prior_knowledge == (directory / "classes.json",)
    assert (objects.delay_threshold, objects.update_bytes) == (250_000, 1_000_000)
    types = {each.name: each.aron_type for each in armar.core_segments}
    assert types["State"] == ALIASES["RobotState"], "given in the file, in another spelling"
    assert types["Proprioception"] is None, "typed = false leaves out those of the profile"

    known = config.long_term
    assert known is not None
    assert (known.memory, known.dsn, known.robot, known.frame) == ("armar7", "memory://", "armar7", "kitchen")
    assert (known.settings.when, known.settings.backlog, known.settings.wait) == (When.ON_EVICTION, 500, 2.0)
    assert not known.settings.at_stop
    instance = MemoryID(memory="Object", core_segment="Instance")
    assert [each for each in known.poses if each.segment == instance] == [
        PosePath.at("globalPose", segment=instance),
        PosePath.at("parts[*].pose", unit="m", segment=instance),
    ]
    assert PosePath.at("globalPose", segment=MemoryID(memory="Armar", core_segment="State")) in known.poses
    assert known.robot_state is not None
    assert known.robot_state.pose == PosePath.at("globalPose", segment=MemoryID.parse("Armar/State"))
    assert known.robot_state.footprint == ((0.4, 0.3), (0.4, -0.3), (-0.4, -0.3), (-0.4, 0.3))
    assert known.robot_state.max_age == 500_000

    assert config.online == (
        TimeDecay(activation=Ebbinghaus(k=1.5, minute=10.0), minimum=0.3),
        Frequency(wait=0.5),
        Similarity(distance="mse", minimum=0.01, count=3),
    )
    assert config.offline == (
        TimeDecay(activation=Exponential(tau=60.0), minimum=0.1),
        Frequency(wait=2.0),
        LatentSimilarity(distance="cosine", minimum=0.1, encoder=RandomProjection(size=8, seed=4)),
        Retention(count=100, size=1000, age=3600.0, total_count=1000, total_size=10000),
    )
    assert not config.keep_newest
    assert (config.ice.mode, config.ice.own_name_system) == (Mode.JOIN, True)
    assert config.ice.slices == (directory / "workspace", Path("/opt/armarx"))
    assert config.ice.properties == {"Ice.Trace.Network": "1"}


def test_what_is_read_makes_memory_servers(directory: Path) -> None:
    (directory / "classes.json").write_text(
        '{"core_segment": "Cup", "provider_segment": "Known", "entities": {"cup": [{"instances": [{"colour": "b"}]}]}}'
    )
    for memory in read(directory, EVERYTHING).memories:
        with MemoryServer(
            memory.name, memory.core_segments, limits=memory.limits, prior_knowledge=memory.prior_knowledge
        ) as server:
            assert server.status().snapshots == (memory.name == "Object")


def test_a_type_alone_in_its_file_needs_no_name(directory: Path) -> None:
    text = '[[memories]]\nname = "A"\n[[memories.core_segments]]\nname = "B"\ntype = {file = "types/cup.xml"}\n'
    ((segment,),) = [memory.core_segments for memory in read(directory, text).memories]
    assert isinstance(segment.aron_type, t.Object)
    assert segment.aron_type.name == "example::dto::Cup"


def test_encoders_by_name(directory: Path) -> None:
    offline = '{distance = "mae", minimum = 1, count = 9, encoder = "pca", size = 3}'
    text = f'[[memories]]\nprofile = "AudioMemory"\n[forgetting.offline]\nsimilarity = {offline}\n'
    assert read(directory, text).offline == (LatentSimilarity(distance="mae", minimum=1, count=9, encoder=PCA(size=3)),)


AUDIO = '[[memories]]\nprofile = "AudioMemory"\n'
OF_A = '[[memories]]\nname = "A"\n[[memories.core_segments]]\nname = "B"\n'


@pytest.mark.parametrize(
    ("text", "key", "says"),
    [
        ("", "", "there are no memories: add a table [[memories]]"),
        ("[[memories]\n", "", "this is no TOML in UTF-8"),
        ("memories = 3\n", "memories", "is a list, not an integer: correct it"),
        ("[[memories]]\n", "memories number 1", "neither a name nor a profile"),
        ('[[memories]]\nname = "A"\n', 'memories "A"', "has no core segments"),
        ('[[memories]]\nname = "A\\u0000"\n', 'memories "A\0".name', "contains the character NUL"),
        (
            '[[memories]]\nprofile = "ObjectsMemory"\n',
            'memories "ObjectsMemory".profile',
            "there are RobotStateMemory, ",
        ),
        (AUDIO + AUDIO, "", "two memories are called 'Audio': give one of them another name"),
        (AUDIO + "histroy = 3\n", 'memories "AudioMemory".histroy', "there is no such key: did you mean history?"),
        (AUDIO + "zzz = 3\n", 'memories "AudioMemory".zzz', "there is no such key: leave it out"),
        (AUDIO + "history = 0\n", 'memories "AudioMemory".history', "is 1 or more, or -1 for none"),
        (AUDIO + 'history = "all"\n', 'memories "AudioMemory".history', "is an integer, not a text: correct it"),
        (AUDIO + "delay_warning = -1\n", 'memories "AudioMemory".delay_warning', "a number of seconds from 0 on"),
        (AUDIO + "delay_warning = nan\n", 'memories "AudioMemory".delay_warning', "a number of seconds from 0 on"),
        (
            AUDIO + 'prior_knowledge = [""]\n',
            'memories "AudioMemory".prior_knowledge',
            "a file or directory has a name, and not ''",
        ),
        (
            AUDIO + "[memories.history_limits]\nChunk = 0\n",
            'memories "AudioMemory".history_limits "Chunk"',
            "Audio/Chunk is 1 or more",
        ),
        (
            AUDIO + '[memories.history_limits]\n"a//b" = 1\n',
            'memories "AudioMemory".history_limits "a//b"',
            "is empty: name it",
        ),
        (AUDIO + '[memories.history_limits]\na = "b"\n', 'memories "AudioMemory".history_limits', "is an integer, not"),
        (
            AUDIO + "[memories.history_limits]\nNope = 3\n",
            'memories "AudioMemory".history_limits "Nope"',
            "there is no core segment 'Nope': add it, or correct this",
        ),
        (
            OF_A + "history = 0\n",
            'memories "A".core_segments "B".history',
            "A/B is 1 or more, or -1 for none",
        ),
        (
            AUDIO + "[[memories.core_segments]]\n",
            'memories "AudioMemory".core_segments number 1.name',
            "is missing: add",
        ),
        (
            AUDIO + '[[memories.core_segments]]\nname = ""\n',
            'memories "AudioMemory".core_segments number 1.name',
            "is empty",
        ),
        (
            OF_A + '[[memories.core_segments]]\nname = "B"\n',
            'memories "A".core_segments "B"',
            "is there twice: drop one",
        ),
        (OF_A + 'type = "ObjectInstanc"\n', 'memories "A".core_segments "B".type', "did you mean 'ObjectInstance'?"),
        (
            OF_A + 'type = "Pose"\n',
            'memories "A".core_segments "B".type',
            "realized by NDArray: take a type with members",
        ),
        (OF_A + 'type = {file = "no.xml"}\n', 'memories "A".core_segments "B".type', "the file cannot be read"),
        (
            OF_A + 'type = {file = "types/cups.xml"}\n',
            '"B".type.name',
            "several types (example::dto::Cup, example::dto",
        ),
        (
            OF_A + 'type = {file = "types/cup.xml", name = "Mug"}\n',
            '"B".type.name',
            "defines no 'Mug', but example::dto",
        ),
        (OF_A + 'type = {name = "Mug"}\n', 'memories "A".core_segments "B".type.file', "is missing: add it"),
        (OF_A + 'poses = ["a..b"]\n[long_term]\n', 'memories "A".core_segments "B".poses', "is no path into data"),
        (OF_A + 'poses = [{path = "a", unit = "ft"}]\n[long_term]\n', '"B".poses', "is one of mm, m, not 'ft'"),
        (AUDIO + "[long_term]\nbacklog = 0\n", "long_term", "backlog of consolidation is 1 or more"),
        (AUDIO + '[long_term]\nwhen = "never"\n', "long_term.when", "is one of on_commit, on_eviction, not 'never'"),
        (
            AUDIO + '[long_term]\nwhen = "on_eviction"\n',
            "long_term.when",
            "nothing ever does, for no history has a limit",
        ),
        (AUDIO + 'history = -1\n[long_term]\nwhen = "on_eviction"\n', "long_term.when", "set history in [[memories]]"),
        (AUDIO + "history = 1\n[long_term]\nat_stop = false\n", "long_term", "goes with when='on_eviction'"),
        (
            AUDIO + "[forgetting.offline]\ntime_decay = {minimum = 1, activation = 'linear'}\n",
            "forgetting.offline.time_decay.activation",
            "is one of exponential, ebbinghaus, not 'linear'",
        ),
        (
            AUDIO + "[forgetting.online]\nretention = {count = 5}\n",
            "forgetting.online.retention",
            "there is no such key here: it is one of [forgetting.offline]",
        ),
        (AUDIO + "ice = 3\n", 'memories "AudioMemory".ice', "it is one of the top of the file"),
        (AUDIO + '[long_term]\nwhen = "on_eviction"\ndurable = true\n', "long_term", "only durable with"),
        (
            AUDIO + '[long_term.robot_state]\nsegment = "Audio"\npose = ""\n',
            "long_term.robot_state.segment",
            "as RobotS",
        ),
        (
            AUDIO + '[long_term.robot_state]\nsegment = "A/B"\npose = ""\n',
            "long_term.robot_state.segment",
            "no core segm",
        ),
        (AUDIO + '[long_term.robot_state]\nsegment = "a//b"\npose = ""\n', "long_term.robot_state.segment", "is empty"),
        *(
            (
                f'{AUDIO}[long_term.robot_state]\nsegment = "Audio/Chunk"\npose = "a"\nfootprint = {footprint}\n',
                "long_term.robot_state.footprint",
                says,
            )
            for footprint, says in (
                ("0.0", "must be greater than 0"),
                ("[]", "three or more corners"),
                ("[[0.0, 0.0], [1.0, 1.0]]", "three or more corners"),
                ("[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]", "is not valid: Self-intersection"),
                ("[[0.0, 0.0], [1.0, 1.0], [1.0, nan]]", "each a finite x and y"),
            )
        ),
        (AUDIO + "[forgetting.online]\nfrequency = {wait = 1}\n", "forgetting.online", 'set when = "on_eviction"'),
        (
            AUDIO + "[forgetting.offline]\nfrequency = {wait = -1}\n",
            "forgetting.offline.frequency",
            "at least 0, not -1",
        ),
        (AUDIO + "[forgetting.offline]\nretention = {}\n", "forgetting.offline.retention", "has no budget: give count"),
        (
            AUDIO + "[forgetting.offline]\ntime_decay = {minimum = 1.679}\n",
            "forgetting.offline.time_decay",
            "more would forget all",
        ),
        (
            AUDIO + "[forgetting.offline]\ntime_decay = {minimum = 0.5, k = 2.0}\n",
            "forgetting.offline.time_decay.k",
            "belongs to the activation ebbinghaus",
        ),
        (
            AUDIO + '[forgetting.offline]\nsimilarity = {distance = "ssim", minimum = 1}\n',
            "forgetting.offline.similarity",
            "one of mse, mae, cosine, not 'ssim'",
        ),
        (
            AUDIO + '[forgetting.offline]\nsimilarity = {distance = "mse", minimum = 1, size = 3}\n',
            "forgetting.offline.similarity.size",
            "belongs to an encoder",
        ),
        (
            AUDIO + '[forgetting.offline]\nsimilarity = {distance = "mse", minimum = 1, encoder = "pca"}\n',
            "forgetting.offline.similarity.size",
            "is missing",
        ),
        (AUDIO + "[ice]\n", "ice.mode", "is missing: add it"),
        (AUDIO + '[ice]\nmode = "standalone"\n', "ice.slices", "is missing: name the directories"),
        (AUDIO + '[ice]\nmode = "join"\nslices = ["."]\n', "ice.locator", "is missing: give the Ice.Default.Locator"),
        (AUDIO + '[ice]\nmode = "none"\nport = 70000\n', "ice.port", "to 65535, not 70000"),
    ],
)
def test_refusals_name_the_key_and_the_remedy(directory: Path, text: str, key: str, says: str) -> None:
    message = refusal(directory, text)
    before, found, why = message.partition(f"{key}: ") if key else ("", ": ", message)
    assert found, f"{key} is not named: {message}"
    assert key.startswith('"') or not before
    assert says in why, message


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(InvalidConfiguration, match=r"nowhere\.toml: the configuration cannot be read \(No such file"):
        read_config(tmp_path / "nowhere.toml")
    (tmp_path / "latin.toml").write_bytes('name = "ü"'.encode("latin-1"))
    with pytest.raises(InvalidConfiguration, match="no TOML in UTF-8"):
        read_config(tmp_path / "latin.toml")
