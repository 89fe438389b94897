# ruff: noqa: E501 (a case reads best on one line)
"""Tests of hostile xacro files: no code execution, no external files, bounded time (CWE-94, CWE-22, CWE-400)."""

import pytest

from simscen.sim.urdf.xacro import limits

PYTHON_ACCESS = [
    "(lambda: 1)()",
    "().__class__.__base__.__subclasses__()",
    "''.__class__",
    "[].__class__.__mro__",
    "__import__('os')",
    "python.type('a')",
    "python.vars()",
    "str.mro()",
    "math.__dict__",
    "xacro.load_yaml('/etc/passwd')",
    "load_yaml('/etc/passwd')",
    "open('/etc/passwd')",
    "[x for x in [1]]",
    "f'a'",
    "(x := 1)",
    "'a'.format(1)",
    "map(str, [1])",
    "max([1, 2], key=str)",
    "len.__self__",
    "dict(**dict(a=1))",
    "print(*[1])",
    "1 &lt;&lt; 99999999",
    "1j",
    "b'a'",
    "...",
]
COSTLY = [
    "9**9**9",
    "2**-2**2**2**2**2**9",
    "10**300",
    "'a'*10**9",
    "10**9*'a'",
    "[0]*10**9",
    "range(10**9)",
    "range(10**12)",
    "round(1, -10**9)",
    "'%999999999d' % 1",
    "'a'.replace('', 'b'*60000).replace('', 'b'*60000)",
    "('b'*60000).join(str(range(30000)))",
    "math.factorial(10**7)",
    "(" * 300 + "1" + ")" * 300,
    "-" * 990 + "1",
    "1" + "+1" * 490 + "**9**9**9",
    "0" * 5000,
    "int('9'*60000)",
    "1e308*10**200",
    "[[1]*60000]*60000",
]


@pytest.mark.parametrize("expression", PYTHON_ACCESS)
def test_expression_cannot_access_python(refusal, expression):
    problem = refusal(f'<a v="${{{expression}}}"/>')

    assert problem.code == "SC400"
    assert (problem.path, problem.line, problem.col) == ("main.xacro", 1, 57)
    assert problem.message.startswith(f"${{{expression.replace('&lt;', '<')}}}: ")


@pytest.mark.parametrize("argument", ["5", "[1]"])
def test_function_with_an_argument_of_another_type_is_refused(refusal, argument):
    problem = refusal(f'<a v="${{xacro.tokenize({argument})}}"/>')
    assert problem.message == f"${{xacro.tokenize({argument})}}: tokenize() takes a text"


@pytest.mark.parametrize("expression", COSTLY)
def test_expression_that_needs_much_time_or_memory_is_refused(refusal, expression):
    assert refusal(f'<a v="${{{expression}}}"/>').code == "SC400"


def test_environment_variables_are_not_read(refusal, value, monkeypatch):
    monkeypatch.setenv("SECRET", "hunter2")

    problem = refusal('<a v="$(env SECRET)"/>')
    assert problem.message == "$(env SECRET): the environment is not read"
    assert problem.hint == "write the value into the file"
    assert value("$(optenv SECRET 0 0 1)") == "0 0 1"
    assert value("$(optenv SECRET)") == ""


@pytest.mark.parametrize("command", ["eval 1", "eval __import__('os')", "anon a", "cwd", "nonsense", ""])
def test_other_substitutions_are_refused(refusal, command):
    assert "is not supported" in refusal(f'<a v="$({command})"/>').message


@pytest.mark.parametrize(
    "path",
    ["/etc/passwd", "../outside.xacro", "link.xacro", "$(find ..)/x", "$(dirname)/../outside.xacro", "a/../../b"],
)
def test_an_include_outside_the_root_is_not_read(refusal, tmp_path, path):
    (tmp_path.parent / "outside.xacro").write_text("<robot/>")
    (tmp_path / "link.xacro").symlink_to(tmp_path.parent / "outside.xacro")

    message = refusal(f'<xacro:include filename="{path}"/>').message
    assert "outside the scenario root" in message or "not the name of a package" in message


def test_existence_of_an_optional_file_outside_is_not_revealed(refusal):
    for path in ("/etc/passwd", "/etc/no-such-file"):
        problem = refusal(f'<xacro:include filename="{path}" optional="true"/>')
        assert problem.message == f"include '{path}': outside the scenario root and the world paths"


def test_symbolic_link_out_of_the_root_is_no_package(refusal, tmp_path):
    (tmp_path / "pkg").symlink_to(tmp_path.parent)
    assert "there is no package 'pkg'" in refusal('<xacro:include filename="$(find pkg)/x.xacro"/>').message


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("a: &x [1]\nb: *x\n", "aliases (`*name`) are not supported in YAML files"),
        ("[" * 30 + "]" * 30, "lists and mappings are nested deeper than 20"),
        ("[" * 100_000, "lists and mappings are nested deeper than 20"),
        ("a: [1\n", "not valid YAML in line 2: expected ',' or ']', but got '<stream end>'"),
        (
            "a: !!python/object/apply:os.system [ls]\n",
            "not valid YAML in line 1: could not determine a constructor for the",
        ),
        ("a: !degrees __import__('os')\n", "__import__() is not supported"),
        ("a: 2001-99-99\n", "not valid YAML"),
        ("a: \x01\n", "not valid YAML"),
    ],
)
def test_hostile_yaml_file_is_refused(refusal, content, message):
    problem = refusal("<a v=\"${xacro.load_yaml('x.yaml')}\"/>", x__yaml=content)
    assert message in problem.message


def test_long_yaml_file_is_refused(refusal, monkeypatch):
    monkeypatch.setattr(limits, "MAX_LENGTH", 1000)
    problem = refusal("<a v=\"${xacro.load_yaml('x.yaml')}\"/>", x__yaml="- 1\n" * 1001)
    assert problem.message == "${xacro.load_yaml('x.yaml')}: the value is longer than 1000"


BOMBS = {
    "a macro that calls itself": '<xacro:macro name="m"><xacro:m/></xacro:macro><xacro:m/>',
    "macros that double": "".join(
        f'<xacro:macro name="m{n}"><xacro:m{n + 1}/><xacro:m{n + 1}/></xacro:macro>' for n in range(40)
    )
    + '<xacro:macro name="m40"><a/></xacro:macro><xacro:m0/>',
    "macros that double without output": "".join(
        f'<xacro:macro name="m{n}"><xacro:m{n + 1}/><xacro:m{n + 1}/></xacro:macro>' for n in range(40)
    )
    + '<xacro:macro name="m40"/><xacro:m0/>',
    "strings that double": "".join(
        f'<xacro:property name="p{n}" value="${{p{n + 1}}}${{p{n + 1}}}"/>' for n in range(40)
    )
    + '<xacro:property name="p40" value="xx"/><a v="${p0}"/>',
    "arguments that double": '<xacro:arg name="a0" default="xx"/>'
    + "".join(f'<xacro:arg name="a{n + 1}" default="$(arg a{n})$(arg a{n})"/>' for n in range(40)),
    "a chain of properties": "".join(f'<xacro:property name="p{n}" value="${{p{n + 1}}}"/>' for n in range(5000))
    + '<xacro:property name="p5000" value="1"/><a v="${p0}"/>',
    "properties in a circle": '<xacro:property name="p" value="${q}"/><xacro:property name="q" value="${p}"/><a v="${p}"/>',
    "a file that includes itself": '<xacro:include filename="main.xacro"/>',
    "many long attributes": '<xacro:property name="p" value="${\'x\' * 60000}"/>' + '<a v="${p}"/>' * 100,
    "blocks that double": "".join(
        f'<xacro:macro name="m{n}" params="*b"><xacro:m{n + 1}><e><xacro:insert_block name="b"/>'
        f'<xacro:insert_block name="b"/></e></xacro:m{n + 1}></xacro:macro>' for n in range(40)
    ) + '<xacro:macro name="m40" params="*b"><xacro:insert_block name="b"/></xacro:macro><xacro:m0><a/></xacro:m0>',
    "lists in lists": '<xacro:property name="p0" value="1"/>' + "".join(
        f'<xacro:property name="p{n}" value="${{[p{n - 1}]}}"/><xacro:if value="${{len(p{n}) == 0}}"/>'
        for n in range(1, 600)
    ),
    "quotes in parameters": f'<xacro:macro name="m" params="p:={"a" * 50000}\'"/>',
}  # fmt: skip


@pytest.mark.sample(4)
@pytest.mark.parametrize("name", BOMBS)
def test_endless_expansion_is_refused(refusal, name):
    assert refusal(BOMBS[name]).code == "SC400"
