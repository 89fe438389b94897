# ruff: noqa: E501 (a case reads best on one line)
"""Tests of xacro expansion against the xacro package."""

from xml.dom.minidom import Element

import pytest
import xacro

CASES = {
    "arithmetic": '<a v="${1 + 2*3} ${7 // 2} ${7 % 4} ${2**10} ${-3.5} ${1/3} ${pi} ${0.1+0.2} ${1e-7}"/>',
    "a lone expression keeps its type": '<xacro:property name="n" value="${2}"/><a v="${n*2}" w="${n}${n}"/>',
    "functions": '<a v="${sin(radians(90))} ${min(1, 2)} ${max([3, 4])} ${abs(-1) if False else 2} ${hypot(3, 4)} '
    "${atan2(1, 2)} ${degrees(pi)} ${round(2.567, 1)} ${int('3')} ${float(2)} ${len('abc')} ${str(4)} ${floor(2.5)}\"/>",
    "namespaces of functions": '<a v="${math.cos(0)} ${python.abs(-2)} ${python.isinstance(3, int)} ${python.sum([1, 2])}"/>',
    "comparisons": '<a v="${1 &lt; 2 &lt; 3} ${1 == 1.0} ${\'a\' in \'abc\'} ${3 not in [1, 2]} ${not 0} ${None is None}"/>',
    "booleans": '<xacro:property name="t" value="true"/><a v="${t} ${t and 3} ${False or \'x\'} ${\'y\' if t else \'n\'}"/>',
    "strings": '<a v="${\'a b\'.split(\' \')[1]} ${\'aB\'.upper()} ${\'x,y\'.replace(\',\', \'-\')} ${\'-\'.join([\'a\', \'b\'])}"/>',
    "lists": '<xacro:property name="l" value="${[1, 2, 3]}"/><a v="${l[0]} ${l[-1]} ${l[1:]} ${len(l)} ${l.pop(0)} ${l}"/>',
    "dictionaries": '<xacro:property name="d" value="${dict(a=1, b=2)}"/><a v="${d[\'a\'] + d[\'b\']}"/>',
    "literals": "".join(
        f'<xacro:property name="p" value="{text}"/><a v="${{p}}"/>'
        for text in ("1", "1.50", "1e3", "1_000", "'1.50'", "true", "False", "0 0 1", "nan", "", " 7 ")
    ),
    "escapes": '<a v="$${x} $$(y) $$${z} a$b c$"/>',
    "lazy": '<xacro:property name="p" value="${q}"/><xacro:property name="q" value="1"/><a v="${p}"/>'
    '<xacro:property name="q" value="2"/><b v="${p}"/>',
    "greedy": '<xacro:property name="q" value="1"/><xacro:property name="p" value="${q}" lazy_eval="false"/>'
    '<xacro:property name="q" value="2"/><a v="${p}"/>',
    "default and remove": '<xacro:property name="p" default="1"/><xacro:property name="p" default="2"/><a v="${p}"/>'
    '<xacro:property name="p" remove="true"/><xacro:property name="p" default="3"/><a v="${p}"/>',
    "property blocks": '<xacro:property name="o"><o x="${w}"/><!-- c --><p/></xacro:property>'
    '<xacro:property name="w" value="5"/><a><xacro:insert_block name="o"/></a>',
    "macros": '<xacro:macro name="m" params="a b:=2 c:=\'x y\' d:=${1 + 1} *e **f"><k v="${a} ${b} ${c} ${d}">'
    '<xacro:insert_block name="e"/><xacro:insert_block name="f"/></k></xacro:macro>'
    '<xacro:m a="1"><e1 z="1"/><f1><f2/><f3/></f1></xacro:m><xacro:m b="${7}" a="8"><e1/><f1/></xacro:m>',
    "macros see the scope of the caller": '<xacro:macro name="i"><a v="${x}"/></xacro:macro>'
    '<xacro:macro name="o" params="x"><xacro:i/></xacro:macro><xacro:o x="3"/>',
    "three quotes": '<xacro:macro name="m" params="ns:=\'\'\'"><a v="[${ns}]"/></xacro:macro><xacro:m/>',
    "forwarded parameters": '<xacro:macro name="m" params="x:=^ y:=^|4 z=^|${5 + 1}"><a v="${x} ${y} ${z}"/></xacro:macro>'
    '<xacro:property name="x" value="1"/><xacro:property name="y" value="2"/><xacro:m/><xacro:m x="9"/>',
    "macros in macros": '<xacro:macro name="o"><xacro:macro name="i"><a/></xacro:macro><xacro:i/></xacro:macro><xacro:o/>',
    "macros are redefined": '<xacro:macro name="m"><a/></xacro:macro><xacro:macro name="m"><b/></xacro:macro><xacro:m/>',
    "called by name": '<xacro:macro name="m" params="x"><a v="${x}"/></xacro:macro><xacro:call macro="${\'m\'}" x="1"/>',
    "blocks that are macros": '<xacro:macro name="o"><i1/></xacro:macro><xacro:macro name="m" params="*b">'
    '<xacro:insert_block name="b"/></xacro:macro><xacro:m><xacro:o/></xacro:m>',
    "scopes": '<xacro:macro name="m"><xacro:property name="g" value="1" scope="global"/>'
    '<xacro:property name="p" value="2" scope="parent"/><xacro:property name="l" value="3"/></xacro:macro>'
    '<xacro:property name="l" value="0"/><xacro:m/><a v="${g} ${p} ${l}"/>',
    "if and unless": '<xacro:if value="${1 == 1}"><a/></xacro:if><xacro:unless value="true"><b/></xacro:unless>'
    '<xacro:if value="0"><c/></xacro:if><xacro:unless value="${[]}"><d/></xacro:unless>'
    '<xacro:if value="1"><xacro:property name="p" value="7"/></xacro:if><e v="${p}"/>',
    "arguments": '<xacro:arg name="x" default="${1 + 1}"/><xacro:arg name="x" default="9"/><a v="$(arg x) ${$(arg x) * 2}"/>',
    "elements and attributes": '<a><xacro:attribute name="${\'k\'}" value="${1 + 1}"/><b/></a>'
    '<xacro:element xacro:name="${\'c\'}" d="1"/>',
    "includes": '<xacro:include filename="part.xacro"/><xacro:include filename="pkg/deep.xacro"/><a v="${from_part}"/><xacro:pm/>'
    '<xacro:include filename="none.xacro" optional="true"/>',
    "namespaces": '<xacro:include filename="part.xacro" ns="n"/><a v="${n.from_part + 1}"/><xacro:n.pm/>',
    "YAML files": "<xacro:property name=\"p\" value=\"${xacro.load_yaml('base.yaml')}\"/>"
    "<a v=\"${p['wheel']['radius'] * 2} ${p.wheel.radius} ${p['wheel'].radius} ${p.axles[1].x} ${len(p.axles)}\"/>"
    "<b v=\"${p.wheel.get('width', 3)} ${'wheel' in p} ${p.angle} ${p.turn} ${p.size} ${p.name} ${p.flag} ${p.none}\"/>"
    "<xacro:if value=\"${p.flag}\"><c/></xacro:if><d v=\"${xacro.load_yaml('base.yaml').wheel.radius}\"/>",
    "messages": '<a v="${xacro.message(\'hello\')}${xacro.warning(\'hm\')}"/><b v="${xacro.tokenize(\'1, 2;3\')}"/>',
}  # fmt: skip
FILES = {
    "part": '<xacro:property name="from_part" value="4"/><xacro:macro name="pm"><k v="${from_part}"/></xacro:macro><p/>',
    "pkg__deep": '<xacro:include filename="deeper.xacro"/>',
    "pkg__deeper": "<deeper/>",
    "base__yaml": "wheel: {radius: 0.0725, mass: 1e-1}\naxles: [{x: -1}, {x: 0.5}]\nangle: !degrees 90\n"
    "turn: !radians pi/2\nsize: !inches 2\nname: front\nflag: yes\nnone: ~\n",
}


@pytest.mark.parametrize("name", CASES)
def test_expansion_equals_that_of_xacro(expand, tmp_path, name):
    ours = expand(CASES[name], **FILES)
    theirs = xacro.process_file(str(tmp_path / "main.xacro"), verbosity=0).documentElement

    assert flat_ours(ours) == flat_theirs(theirs)
    assert ours.children  # the expansion is not empty


def flat_ours(element):
    return element.tag, _sorted_attributes(element.attributes), [flat_ours(child) for child in element.children]


def flat_theirs(node):
    children = [flat_theirs(child) for child in node.childNodes if isinstance(child, Element)]
    return node.tagName, _sorted_attributes(dict(node.attributes.items())), children


def _sorted_attributes(attributes):
    return sorted((name, str(text)) for name, text in attributes.items() if not name.startswith("xmlns"))


BROKEN = {
    "unknown macro": "<xacro:nothing/>",
    "unknown property": '<a v="${nothing}"/>',
    "missing parameter": '<xacro:macro name="m" params="a"/><xacro:m/>',
    "too many parameters": '<xacro:macro name="m"/><xacro:m a="1"/>',
    "missing block": '<xacro:macro name="m" params="*b"/><xacro:m/>',
    "too many blocks": '<xacro:macro name="m"/><xacro:m><a/></xacro:m>',
    "unknown block": '<xacro:insert_block name="b"/>',
    "not a condition": '<xacro:if value="perhaps"/>',
    "missing file": '<xacro:include filename="none.xacro"/>',
    "missing argument": '<a v="$(arg nothing)"/>',
    "an open bracket": '<a v="${1"/>',
    "no expression": '<a v="${1 +}"/>',
    "division by zero": '<a v="${1 / 0}"/>',
    "a property without a name": '<xacro:property value="1"/>',
    "not a name": '<xacro:property name="a b" value="1"/>',
    "nothing to forward": '<xacro:macro name="m" params="x:=^"/><xacro:m/>',
    "value and default": '<xacro:property name="p" value="1" default="2"/>',
    "missing YAML file": "<a v=\"${xacro.load_yaml('none.yaml')}\"/>",
    "missing key": "<a v=\"${xacro.load_yaml('base.yaml').none}\"/>",
    "fatal": "<a v=\"${xacro.fatal('no such wheel')}\"/>",
}


@pytest.mark.parametrize("name", BROKEN)
def test_errors_of_xacro_have_positions(refusal, tmp_path, name):
    problem = refusal(BROKEN[name], base__yaml="a: 1\n")

    assert problem.message
    assert problem.line == 1
    with pytest.raises((xacro.XacroException, OSError, RuntimeError)):
        xacro.process_file(str(tmp_path / "main.xacro"), verbosity=0)
