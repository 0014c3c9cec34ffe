"""Exact real numbers: signs, arithmetic and fields, checked against interval arithmetic."""

from __future__ import annotations

import pickle
import subprocess
import sys
from fractions import Fraction

import flint
import numpy as np
import pytest
from enclosures import BITS, enclosed_number, rationals
from hypothesis import given, settings
from hypothesis import strategies as st

from bcut.geometry.fields import field_for
from bcut.geometry.numbers import (
    RATIONALS,
    AlgebraicNumber,
    exact_scalar,
    parse_number,
    real_field,
)
from bcut.geometry.radicals import cosine_terms, sqrt_terms

FIELDS = [
    (1, (1,)),
    (1, (1, 5)),
    (1, (1, 2, 3, 6)),
    (7, (1,)),
    (16, (1,)),
    (15, (1, 2)),
    (35, (1,)),
    (23, (1,)),
]


@pytest.mark.parametrize(
    ("text", "degree"),
    [
        ("sqrt(2)+sqrt(3)", 4),
        ("sqrt(2)*sqrt(3)", 2),
        ("cos(2*pi/5)", 2),
        ("cos(2*pi/24)", 4),
        ("cos(2*pi/7)", 3),
        ("cos(2*pi/7)+sqrt(5)", 6),
        ("cos(2*pi/9)+cos(2*pi/7)", 18),
        ("cos(2*pi/15)+sqrt(5)", 4),
        ("cos(2*pi/127)", 63),
    ],
)
def test_fields_are_as_small_as_they_can_be(text: str, degree: int) -> None:
    number = parse_number(text)
    assert isinstance(number, AlgebraicNumber)
    assert number.field.degree == degree


@pytest.mark.parametrize("key", FIELDS)
def test_structure_constants_multiply_the_basis(key: tuple[int, tuple[int, ...]]) -> None:
    field = real_field(*key)
    r = field.degree
    structure = field.structure
    assert structure.shape == (r, r, r)
    assert structure.dtype == np.int64
    np.testing.assert_array_equal(structure[0], np.eye(r, dtype=int))  # the first basis element is 1
    np.testing.assert_array_equal(structure, structure.transpose(1, 0, 2))
    left = np.einsum("ijk,klm->ijlm", structure, structure)  # (b_i b_j) b_l
    np.testing.assert_array_equal(left, left.transpose(2, 1, 0, 3))
    products = np.outer(field.basis_floats, field.basis_floats)
    np.testing.assert_allclose(structure @ field.basis_floats, products, atol=1e-9)


@pytest.mark.parametrize("key", FIELDS)
def test_vectorised_signs_equal_exact_ones(key: tuple[int, tuple[int, ...]]) -> None:
    field = real_field(*key)
    rng = np.random.default_rng(key[0])
    small = rng.integers(-3, 4, size=(40, field.degree))
    large = rng.integers(-(2**61), 2**61, size=(40, field.degree))
    # Nearly zero: the rational coefficient cancels the rest up to rounding.
    close = rng.integers(-(10**9), 10**9, size=(200, field.degree))
    close[:, 0] = -np.round(close[:, 1:] @ field.basis_floats[1:]).astype(np.int64)
    huge = np.array([[int(v) * 10**400 for v in row] for row in small], dtype=object)
    for array in (
        small,
        large,
        close,
        huge,
        close.reshape(20, 10, -1),
        np.zeros((3, field.degree), dtype=int),
    ):
        signs = field.signs(array)
        assert signs.dtype == np.int8
        expected = [field.sign(row) for row in array.reshape(-1, field.degree).tolist()]
        assert signs.ravel().tolist() == expected


def test_signs_of_ever_smaller_numbers_are_exact() -> None:
    # (sqrt(2) - 1)^k and (phi - 1)^k are positive and tend to zero; their coefficients grow.
    for text in ("sqrt(2)-1", "(sqrt(5)-1)/2", "cos(2*pi/7)-1/2", "sqrt(3)-sqrt(2)-1/4"):
        number = parse_number(text)
        assert isinstance(number, AlgebraicNumber)
        power = number**200
        numerators, _ = power.integers()
        assert power.sign() == 1
        assert (-(power * number)).sign() == -1
        assert number.field.signs(np.array([numerators], dtype=object)).tolist() == [1]
        with flint.ctx.workprec(4000):  # all but the last hundred bits of the definition cancel
            assert float(power) == float(enclosed_number(power).mid())


@settings(max_examples=80, deadline=None)
@given(st.sampled_from(FIELDS[1:]), st.data())
def test_arithmetic_obeys_the_field_axioms(key: tuple[int, tuple[int, ...]], data: st.DataObject) -> None:
    field = real_field(*key)
    elements = st.lists(rationals(), min_size=field.degree, max_size=field.degree)
    a, b, c = (AlgebraicNumber(field, tuple(data.draw(elements))) for _ in range(3))
    assert (a + b) * c == a * c + b * c
    assert a - a == 0
    assert a * b == b * a
    if a:
        assert a * (1 / a) == 1
        assert (b / a) * a == b
        assert a**-2 * a**2 == 1
    assert (a < b) == ((b - a).sign() > 0)
    assert abs(a) >= 0
    with flint.ctx.workprec(BITS):
        assert enclosed_number(a * b + c).overlaps(
            enclosed_number(a) * enclosed_number(b) + enclosed_number(c)
        )


@settings(max_examples=80, deadline=None)
@given(st.sampled_from(FIELDS), st.data())
def test_nearest_floats_are_correctly_rounded(key: tuple[int, tuple[int, ...]], data: st.DataObject) -> None:
    field = real_field(*key)
    size = {"min_size": field.degree, "max_size": field.degree}
    numerators = data.draw(st.lists(st.integers(-(10**20), 10**20), **size))
    denominator = data.draw(st.integers(1, 10**20))
    value = field.nearest_float(numerators, denominator)
    with flint.ctx.workprec(BITS):
        exact = enclosed_number(exact_scalar(field, numerators, denominator))
        below, above = np.nextafter(value, -np.inf), np.nextafter(value, np.inf)
        assert 2 * exact >= flint.arb(value) + flint.arb(float(below)) or not any(numerators)
        assert 2 * exact <= flint.arb(value) + flint.arb(float(above)) or not any(numerators)


@pytest.mark.parametrize(
    ("text", "equal"),
    [
        ("cos(2*pi/13)*0+sqrt(13)", "sqrt(13)"),
        ("2*(cos(2*pi/13)+cos(6*pi/13)+cos(8*pi/13))", "(sqrt(13)-1)/2"),
        ("2*(cos(2*pi/17)+cos(4*pi/17)+cos(8*pi/17)+cos(16*pi/17))", "(sqrt(17)-1)/2"),
        ("cos(2*pi/56)**2-cos(4*pi/56)/2", "1/2"),
        ("cos(2*pi/16)**2", "1/2+sqrt(2)/4"),
        # sqrt(21) lies in the field of order 21, so sqrt(7) is written with sqrt(21) and sqrt(3).
        ("cos(2*pi/21)+sqrt(7)-cos(2*pi/21)", "sqrt(7)"),
        ("(sqrt(7)*cos(2*pi/21))**2/7", "cos(2*pi/21)**2"),
    ],
)
def test_identities_between_fields_hold_exactly(text: str, equal: str) -> None:
    left, right = parse_number(text), parse_number(equal)
    assert left == right
    assert hash(left) == hash(right)
    assert left != right + 1


def test_equal_numbers_of_different_fields_are_equal_and_hash_alike() -> None:
    inside = parse_number("cos(2*pi/15)*0+sqrt(5)")
    field = field_for([*sqrt_terms(Fraction(5)), *cosine_terms(Fraction(1, 15))])
    outside = AlgebraicNumber(field, tuple(field.embed(sqrt_terms(Fraction(5))[0])))
    assert isinstance(inside, AlgebraicNumber)
    assert outside.field != inside.field
    assert outside == inside
    assert hash(outside) == hash(inside)
    assert AlgebraicNumber.of(field, 3) == 3 == AlgebraicNumber.of(field, Fraction(3))
    assert hash(AlgebraicNumber.of(field, 3)) == hash(3)


def test_numbers_of_different_fields_do_not_mix_silently() -> None:
    with pytest.raises(ValueError, match="different fields"):
        parse_number("sqrt(2)") + parse_number("sqrt(3)")
    with pytest.raises(TypeError):
        parse_number("sqrt(2)") + 0.5  # type: ignore[operator]


def test_exact_scalars_of_the_rationals_are_fractions() -> None:
    assert exact_scalar(RATIONALS, [6], 4) == Fraction(3, 2)
    assert type(exact_scalar(RATIONALS, [6], 4)) is Fraction
    assert RATIONALS.signs(np.array([[5], [0], [-7]])).tolist() == [1, 0, -1]


def test_numbers_survive_pickling() -> None:
    number = parse_number("cos(2*pi/7)+sqrt(2)")
    again = pickle.loads(pickle.dumps(number))
    assert again == number
    assert again.field is number.field  # type: ignore[union-attr]


def test_rational_instances_never_import_the_number_field_library() -> None:
    code = (
        "import sys, bcut.families as f, bcut.files, bcut.instance\n"
        "[f.build(t).digest for t in ('cube:3', 'random:9,3,seed=1', 'polygon:6')]\n"
        "f.build('dodecahedron')\n"
        "bad = {'flint', 'scipy', 'trimesh', 'networkx', 'pyscipopt'} & set(sys.modules)\n"
        "sys.exit(' '.join(sorted(bad)) or 0)"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr) == (0, "")
