"""ArmarX's XML type definitions: the printed listings, all the tags, includes, and what is refused where."""

from __future__ import annotations

from pathlib import Path

import pytest

import armem_bridge.aron.type_objects as t
from armem_bridge.aron.aliases import ALIASES
from armem_bridge.aron.definitions import parse_definitions, read_definitions
from armem_bridge.errors import InvalidDefinition
from tests.armem.aron.listings import LISTINGS, document

POSE = t.NDArray(shape=(4, 4), element="float32")
LOCATION = t.Object(name="example::dto::Location", members={"name": t.String(), "global_pose": POSE})
OBJECT = t.Object(name="example::dto::Object", members={"name": t.String(), "position": LOCATION})
FRAMED_POSE = t.Object(
    name="FramedPose",
    members={
        "header": t.Object(name="FrameID", members={"frame": t.String(), "agent": t.String()}),
        "pose": POSE,
    },
)
EXPECTED = {
    "4.1": t.Object(name="example::dto::UserCommand", members={"cmd": t.String()}),
    "4.3": LOCATION,
    "4.4": OBJECT,
    "4.5": t.Object(
        name="example::dto::Proprioception",
        members={"global_pose": POSE, "configuration": t.Dict(accepted=t.Float())},
    ),
    "4.6": t.Object(
        name="example::dto::Vision",
        members={
            "image_rgb": t.NDArray(shape=(1920, 1080, 3), element="uint8", either_order=True),
            "image_depth": t.NDArray(shape=(1920, 1080, 1), element="float32", either_order=True),
        },
    ),
    "4.7": t.Object(
        name="example::dto::KnownGrasp",
        members={"reference_object": OBJECT, "prepose": FRAMED_POSE, "grasppose": FRAMED_POSE},
    ),
    "4.8": t.Object(
        name="armem::dto::MemoryID",
        members={
            "memory_name": t.String(),
            "core_segment_name": t.String(),
            "provider_segment_name": t.String(),
            "entity": t.String(),
            "timestamp": ALIASES["DateTime"],
            "instance": t.Int(),
        },
    ),
}


@pytest.fixture
def files(tmp_path: Path) -> dict[str, Path]:
    """The listings as files."""
    paths = {number: tmp_path / f"{number}.xml" for number in LISTINGS}
    for number, path in paths.items():
        path.write_text(LISTINGS[number])
    return paths


@pytest.mark.parametrize("number", LISTINGS)
def test_the_listings(number: str, files: dict[str, Path]) -> None:
    expected = EXPECTED[number]
    # Whatever the order of the files.
    assert read_definitions(*files.values())[expected.name] == expected
    assert read_definitions(*reversed(files.values()))[expected.name] == expected


def test_listings_one_after_the_other() -> None:
    known: dict[str, t.TypeObject] = {}
    for text in LISTINGS.values():
        known |= parse_definitions(text, known=known)
    assert known == {expected.name: expected for expected in EXPECTED.values()}


def member(inner: str, **others: str) -> t.TypeObject:
    """The type that a tag stands for."""
    types = parse_definitions(
        document(f'<object name="X"><objectchild key="x">{inner}</objectchild></object>', **others)
    )
    found = types["X"]
    assert isinstance(found, t.Object)
    return found.members["x"]


@pytest.mark.parametrize(
    ("tag", "type_object"),
    [
        ("<string/>", t.String()),
        ("<bool/>", t.Bool()),
        ("<int/>", t.Int()),
        ("<int32/>", t.Int()),
        ("<Int32 />", t.Int()),
        ("<long/>", t.Long()),
        ("<int64/>", t.Long()),
        ("<time/>", t.Long()),
        ("<float/>", t.Float()),
        ("<float32/>", t.Float()),
        ("<double/>", t.Double()),
        ("<float64/>", t.Double()),
        ("<any/>", t.Any()),
        ("<AnyObject/>", t.Any()),
        ('<string optional="true"/>', t.String(maybe=True)),
        ('<string maybe="true"/>', t.String(maybe=True)),
        ('<string maybe="optional"/>', t.String(maybe=True)),
        ('<string maybe="none"/>', t.String()),
        ('<string shared_ptr="1"/>', t.String(maybe=True)),
        ('<string unique_ptr="yes"/>', t.String(maybe=True)),
        ('<string raw-ptr="True"/>', t.String(maybe=True)),
        ('<string optional="false"/>', t.String()),
        ('<string doc-brief="what it is"/>', t.String()),
        ("<list><int/></list>", t.List(accepted=t.Int())),
        ('<list optional="1"><int optional="1"/></list>', t.List(accepted=t.Int(maybe=True), maybe=True)),
        ("<dict><pose/></dict>", t.Dict(accepted=POSE)),
        ("<Dictionary><list><bool/></list></Dictionary>", t.Dict(accepted=t.List(accepted=t.Bool()))),
        ("<pair><int/><string/></pair>", t.Pair(first=t.Int(), second=t.String())),
        ("<tuple><int/><string/><int/></tuple>", t.Tuple(accepted=(t.Int(), t.String(), t.Int()))),
        (
            '<object name="Inner"><objectchild key="a"><int/></objectchild></object>',
            t.Object(name="Inner", members={"a": t.Int()}),
        ),
        ("<ndarray/>", t.NDArray()),
        ('<ndarray dimensions="3" type="uint8"/>', t.NDArray(shape=(None, None, None), element="uint8")),
        ('<NDArray ndim="0" type="float"/>', t.NDArray(shape=(), element="float")),
        ('<matrix rows="3" cols="2" type="float64"/>', t.NDArray(shape=(3, 2), element="float64")),
        ('<EigenMatrix rows="-1" cols="4"/>', t.NDArray(shape=(None, 4), element="float32")),
        ('<matrix rows="4" cols="dynamic" type="int16"/>', t.NDArray(shape=(4, None), element="int16")),
        ("<quaternion/>", t.NDArray(shape=(4,), element="float32")),
        ('<quaternion type="double"/>', t.NDArray(shape=(4,), element="double")),
        ("<image/>", t.NDArray(shape=(None, None, 3), element="uint8")),
        ('<image pixelType="depth32"/>', t.NDArray(shape=(None, None, 1), element="float32")),
        ('<PointCloud voxelType="PointXYZRGBA"/>', t.NDArray(element="pcl::PointXYZRGBA")),
        ('<pointcloud type="pcl::PointXYZ"/>', t.NDArray(element="pcl::PointXYZ")),
        ("<framed_pose/>", FRAMED_POSE),
        ("<FramedPose/>", FRAMED_POSE),
        ("<framed-pose optional='1'/>", t.as_maybe(FRAMED_POSE)),
        ('<object name="FramedPose"/>', FRAMED_POSE),
    ],
)
def test_every_tag(tag: str, type_object: t.TypeObject) -> None:
    assert member(tag) == type_object


@pytest.mark.parametrize("name", ALIASES)
def test_every_alias_is_a_tag(name: str) -> None:
    assert member(f"<{name}/>") == ALIASES[name]
    assert member(f'<{name.lower()} optional="true"/>') == t.as_maybe(ALIASES[name])


def test_enumerations_and_inheritance() -> None:
    types = parse_definitions(
        document(
            '<Object name="Cup" namespace="::a::b" extends="Thing">'
            '  <ObjectChild key="side"><int-enum name="Side"/></ObjectChild>'
            '  <ObjectChild key="other"><object name="::a::Thing" shared_ptr="true"/></ObjectChild>'
            "</Object>",
            '<Object name="a::Thing"><ObjectChild key="name"><string/></ObjectChild></Object>',
            '<IntEnum name="a::b::Side"><EnumValue key="L" value="0"/><enum-value key="R" value="0x10"/></IntEnum>',
        )
    )
    thing = t.Object(name="a::Thing", members={"name": t.String()})
    side = t.IntEnum(name="a::b::Side", values={"L": 0, "R": 16})
    cup = t.Object(name="a::b::Cup", members={"side": side, "other": t.as_maybe(thing)}, extends=thing)
    assert types == {"a::b::Cup": cup, "a::Thing": thing, "a::b::Side": side}


def test_names_are_looked_up_from_the_innermost_outwards() -> None:
    types = parse_definitions(
        document(
            '<object name="T" namespace="a::b"><objectchild key="x"><int/></objectchild></object>',
            '<object name="T" namespace="a"><objectchild key="x"><string/></objectchild></object>',
            '<object name="U" namespace="a::b"><objectchild key="t"><object name="T"/></objectchild></object>',
            '<object name="V" namespace="a"><objectchild key="t"><object name="T"/></objectchild></object>',
            '<object name="W" namespace="a::b"><objectchild key="t"><a::T/></objectchild></object>',
        )
    )
    for name, inner in (("a::b::U", "a::b::T"), ("a::V", "a::T"), ("a::b::W", "a::T")):
        found = types[name]
        assert isinstance(found, t.Object)
        assert found.members["t"] == types[inner]


def test_own_types_come_before_aliases() -> None:
    types = parse_definitions(
        document(
            '<object name="Human" namespace="a"><objectchild key="x"><int/></objectchild></object>',
            '<object name="U" namespace="a"><objectchild key="h"><Human/></objectchild></object>',
        )
    )
    found = types["a::U"]
    assert isinstance(found, t.Object)
    assert found.members["h"] == types["a::Human"] != ALIASES["Human"]


def test_includes_between_files(tmp_path: Path) -> None:
    package = tmp_path / "include" / "RobotAPI" / "aron"
    package.mkdir(parents=True)
    (tmp_path / "beside.xml").write_text(LISTINGS["4.3"])
    (package / "grasp.xml").write_text(
        document(
            '<object name="Grasp"><objectchild key="where"><example::dto::Location/></objectchild></object>',
            includes="""<AronIncludes><include include="../../../start.xml"/></AronIncludes>""",
        )
    )
    start = tmp_path / "start.xml"
    start.write_text(
        document(
            '<object name="Start"><objectchild key="grasp"><object name="Grasp"/></objectchild></object>',
            includes="""
            <CodeIncludes><Include include="&lt;some/header.h&gt;"/></CodeIncludes>
            <AronIncludes>
              <Include include="&lt;RobotAPI/aron/grasp.xml&gt;" autoinclude="true"/>
              <PackagePath package="RobotAPI" path="aron/grasp.xml"/>
              <include include="beside.xml"/>
            </AronIncludes>""",
        )
    )
    types = read_definitions(start, include_directories=[tmp_path / "include"])

    assert types.keys() == {"Start", "Grasp", "example::dto::Location"}
    grasp = t.Object(name="Grasp", members={"where": LOCATION})
    assert types["Start"] == t.Object(name="Start", members={"grasp": grasp})
    with pytest.raises(
        InvalidDefinition, match=r"start.xml:5: the included file 'RobotAPI/aron/grasp.xml' is not found"
    ):
        read_definitions(start)
    with pytest.raises(InvalidDefinition, match="no include directories"):
        parse_definitions(start.read_text())


HEAD = '<?xml version="1.0"?>\n<typedefinition>\n<generatetypes>\n'
CHILD = "<objectchild key='a'><int/></objectchild>"
TAIL = "\n</generatetypes>\n</typedefinition>"


def wrapped(inner: str) -> str:
    """An object whose member is in line 5."""
    return f'{HEAD}<object name="X">\n<objectchild key="x">{inner}</objectchild>\n</object>{TAIL}'


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "is broken"),
        ("<typedefinition>", "is broken"),
        ("no xml", "is broken"),
        ("<other/>", ":1: the root of a type definition is <typedefinition>, not <other>"),
        ("<typedefinition/>", ":1: there is no <generatetypes>"),
        ("<typedefinition><generatetypes/><what/></typedefinition>", ":1: <what> is not known"),
        ("<typedefinition x='1'><generatetypes/></typedefinition>", "attribute 'x'"),
        (f"{HEAD}<string/>{TAIL}", ":4: <string> defines no type"),
        (f"{HEAD}<object/>{TAIL}", ":4: <object> has no 'name'"),
        (f"{HEAD}<object name='X'><string/></object>{TAIL}", ":4: <string> is not known: an object holds"),
        (f"{HEAD}<object name='X' optional='1'/>{TAIL}", ":4: the attribute 'optional'"),
        (f"{HEAD}<object name='X' nmaespace='a'/>{TAIL}", ":4: the attribute 'nmaespace'"),
        (f"{HEAD}<object name='X'/>\n<object name='::X'/>{TAIL}", ":5: 'X' is defined twice, here and in .*:4"),
        (f"{HEAD}<object name='X' extends='Y'/>{TAIL}", ":4: the type 'Y' is not known"),
        (f"{HEAD}<object name='X' extends='X'/>{TAIL}", ":4: 'X' contains itself"),
        (f"{HEAD}<object name='X' extends='Pose'/>{TAIL}", ":4: 'X' extends 'Pose', which is no object type"),
        (
            f"{HEAD}<object name='X' extends='FrameID'><objectchild key='frame'><int/></objectchild></object>{TAIL}",
            "defines .'frame'. that it inherits",
        ),
        (f"{HEAD}<intenum name='E'/>{TAIL}", ":4: the enumeration 'E' has no values"),
        (f"{HEAD}<intenum name='E'><value/></intenum>{TAIL}", ":4: <value> is not known"),
        (f"{HEAD}<intenum name='E'><enumvalue key='A'/></intenum>{TAIL}", ":4: <enumvalue> has no 'value'"),
        (f"{HEAD}<intenum name='E'><enumvalue key='A' value='x'/></intenum>{TAIL}", "'x' is no integer"),
        (f"{HEAD}<intenum name='E'><enumvalue key='A' value='4294967296'/></intenum>{TAIL}", "32-bit"),
        (f"{HEAD}<intenum name='E'><enumvalue key='A' value='{'1' * 9999}'/></intenum>{TAIL}", "32-bit"),
        (
            f"{HEAD}<intenum name='E'><enumvalue key='A' value='1'/>\n<enumvalue key='A' value='2'/></intenum>{TAIL}",
            ":5: 'E' has the value 'A' twice",
        ),
        (wrapped(""), ":5: the member 'x' has one type, not 0"),
        (wrapped("<int/><int/>"), ":5: the member 'x' has one type, not 2"),
        (wrapped("text"), ":5: text has no meaning here: 'text'"),
        (wrapped("<strin/>"), ":5: the type 'strin' is not known"),
        (wrapped('<object name="Y"/>'), ":5: the type 'Y' is not known"),
        (wrapped('<object name="X"/>'), ":4: 'X' contains itself .X > X."),
        (wrapped('<string optional="maybe"/>'), ":5: optional='maybe' is neither true nor false"),
        (wrapped('<string length="3"/>'), ":5: the attribute 'length' of <string> is not known"),
        (wrapped("<string><int/></string>"), ":5: <string> holds no other elements"),
        (wrapped("<image><int/></image>"), ":5: <image> holds no other elements"),
        (wrapped("<list/>"), ":5: <list> holds 1 type, not 0"),
        (wrapped("<list><int/><int/></list>"), ":5: <list> holds 1 type, not 2"),
        (wrapped("<dict/>"), ":5: <dict> holds 1 type, not 0"),
        (wrapped("<pair><int/></pair>"), ":5: <pair> holds 2 types, not 1"),
        (wrapped("<tuple/>"), ":5: <tuple> holds at least one type, not 0"),
        (wrapped('<image type="yuv"/>'), ":5: images have pixels of type rgb24 or depth32"),
        (wrapped('<image width="wide"/>'), ":5: width='wide' is no integer"),
        (wrapped('<image width="-7"/>'), ":5: width='-7' is no count"),
        (wrapped('<ndarray dimensions="1000000000"/>'), "at most 64"),
        (wrapped("<pointcloud/>"), ":5: a point cloud says of which points"),
        (
            f"{HEAD}<object name='X'>\n<objectchild><int/></objectchild></object>{TAIL}",
            ":5: <objectchild> has no 'key'",
        ),
        (
            f"{HEAD}<object name='X'>{CHILD}\n{CHILD}</object>{TAIL}",
            ":5: 'X' has the member 'a' twice",
        ),
        ("<typedefinition><aronincludes><x/></aronincludes><generatetypes/></typedefinition>", "<x> is not known"),
        ("<typedefinition><aronincludes><include/></aronincludes><generatetypes/></typedefinition>", "no 'include'"),
        ("<typedefinition>" * 201, "deeper than 200"),
        ('<?xml version="1.0" encoding="klingon"?><typedefinition/>', "\\(test\\).*(broken|cannot be read)"),
    ],
)
def test_what_is_no_definition_is_refused_with_its_line(text: str, says: str) -> None:
    with pytest.raises(InvalidDefinition, match=says) as refused:
        parse_definitions(text.encode(), source="(test)")
    assert str(refused.value).startswith("(test):")


def test_types_that_contain_each_other_are_refused() -> None:
    pairs = [("A", "B"), ("B", "C"), ("C", "A")]
    text = document(
        *(f'<object name="{a}"><objectchild key="x"><list><{b}/></list></objectchild></object>' for a, b in pairs)
    )
    with pytest.raises(InvalidDefinition, match=r"'A' contains itself \(A > B > C > A\)"):
        parse_definitions(text)


def test_long_chains_of_types_are_read_or_refused_in_words() -> None:
    def chain(length: int) -> str:
        last = '<object name="T0"/>'
        return document(
            last,
            *(
                f'<object name="T{i}"><objectchild key="x"><object name="T{i - 1}"/></objectchild></object>'
                for i in range(length, 0, -1)
            ),
        )

    assert len(parse_definitions(chain(50))) == 51
    for length in (300, 3000):
        with pytest.raises(InvalidDefinition, match=r"too deep|deeper than"):
            parse_definitions(chain(length))


BOMB = """<?xml version="1.0"?>
<!DOCTYPE lolz [
<!ENTITY lol "lol">
<!ENTITY lol1 "&lol;&lol;&lol;&lol;&lol;&lol;&lol;&lol;&lol;&lol;">
<!ENTITY lol2 "&lol1;&lol1;&lol1;&lol1;&lol1;&lol1;&lol1;&lol1;&lol1;&lol1;">
]>
<typedefinition><generatetypes>&lol2;</generatetypes></typedefinition>"""

FOREIGN = """<!DOCTYPE x [<!ENTITY file SYSTEM "file:///etc/hostname">]>
<typedefinition><generatetypes>&file;</generatetypes></typedefinition>"""


@pytest.mark.parametrize("text", [BOMB, FOREIGN, "<!DOCTYPE html><typedefinition/>"])
def test_document_types_are_refused(text: str) -> None:
    with pytest.raises(InvalidDefinition, match="document type"):
        parse_definitions(text)


def test_unknown_entities_are_refused() -> None:
    with pytest.raises(InvalidDefinition, match="undefined entity"):
        parse_definitions(wrapped("&what;"))


def test_halves_of_characters_are_refused() -> None:
    with pytest.raises(InvalidDefinition, match="broken"):
        parse_definitions(document('<object name="\ud800"/>'))


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(InvalidDefinition, match=r"missing.xml: the file cannot be read \(No such file"):
        read_definitions(tmp_path / "missing.xml")
    with pytest.raises(InvalidDefinition, match="Is a directory"):
        read_definitions(tmp_path)
    latin = tmp_path / "latin.xml"
    latin.write_bytes(document('<object name="Möbel"/>').replace("utf-8", "iso-8859-1").encode("latin-1"))
    assert list(read_definitions(latin)) == ["Möbel"]
    large = tmp_path / "large.xml"
    with large.open("wb") as file:
        file.truncate(17 * 1024 * 1024)
    with pytest.raises(InvalidDefinition, match="no type definition"):
        read_definitions(large)
