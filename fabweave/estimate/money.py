"""Say what sheets, fasteners and hours of the machine cost: ranges, each in one currency."""

from collections.abc import Iterable, Sequence

from fabweave.core.records import record
from fabweave.estimate.assembly_time import hardware_for
from fabweave.plan.bill_of_materials import BillOfMaterials
from fabweave.stock.machine import CURRENCY, Span, as_span
from fabweave.stock.material import Material

_HOUR_S = 3600.0
#: Glue and tape for one joint, in euros: estimates.
_GLUE_PRICE, _TAPE_PRICE = 0.01, 0.02


@record
class Price:
    """From the least to the greatest amount; a currency that nobody named is empty."""

    low: float
    high: float
    currency: str


def priced(span: Span, currency: str) -> Price:
    """Return a range as a price, rounded to a hundredth of a cent."""
    return Price(low=round(span[0], 4), high=round(span[1], 4), currency=currency)


def price_text(price: Price | None) -> str:
    """Return a price as people write it.

    Examples
    --------
    >>> price_text(priced((1.4, 3.5), "EUR")), price_text(priced((12.0, 19.6), "USD"))
    ('1.40 to 3.50 EUR', '12 to 20 USD')
    >>> price_text(priced((2.8, 2.8), "")), price_text(None)
    ('2.80', 'unknown')
    """
    if price is None:
        return "unknown"
    digits = 2 if price.high < 10.0 else 0
    low, high = f"{price.low:.{digits}f}", f"{price.high:.{digits}f}"
    return f"{low if low == high else f'{low} to {high}'} {price.currency}".rstrip()


def sheet_price(
    area_mm2: Span | float, material: Material, stated: float | None = None
) -> Price | None:
    """Return what a sheet costs: what a list of stock says, or by its area.

    Parameters
    ----------
    area_mm2 : float or (float, float)
    material : Material
    stated : float, optional
        Its price in a list of stock, which has no currency: that of the material is meant.

    Returns
    -------
    Price or None
        None where no price is known.
    """
    if stated is not None:
        return priced((stated, stated), material.currency)
    if material.price_per_m2 is None:
        return None
    low, high = as_span(material.price_per_m2)
    least, most = as_span(area_mm2)
    return priced((low * least * 1e-6, high * most * 1e-6), material.currency)


def hardware_price(bill: BillOfMaterials) -> Price:
    """Return what fasteners with their spares, glue and tape cost; nothing costs nothing.

    Examples
    --------
    >>> from fabweave.plan.bill_of_materials import FastenerRow, GlueRow, TapeRow
    >>> row = FastenerRow(diameter_mm=2.5, layers=2, grip_mm=0.8, needed=90, spare=10, buy=100)
    >>> glue, tape = GlueRow(joints=5, area_mm2=1.0), TapeRow(joints=0, length_mm=0.0)
    >>> bill = BillOfMaterials(fasteners=(row,), glue=glue, tape=tape)
    >>> price_text(hardware_price(bill))
    '3 to 15 EUR'
    """
    low = high = _GLUE_PRICE * bill.glue.joints + _TAPE_PRICE * bill.tape.joints
    for row in bill.fasteners:
        least, most = fastener_price(row.diameter_mm, bill)
        low, high = low + row.buy * least, high + row.buy * most
    return priced((low, high), CURRENCY)


def fastener_price(hole_mm: float, bill: BillOfMaterials) -> Span:
    """Return what a fastener for a hole costs, from the cheapest to the dearest that fits."""
    each = [sort.each for sort in hardware_for(hole_mm, bill)]
    return min(low for low, _ in each), max(high for _, high in each)


def machine_price(seconds: Sequence[Span | None], materials: Sequence[Material]) -> Price | None:
    """Return what the machine's hours cost, where all materials say what one costs."""
    prices: list[Price | None] = []
    for span, material in zip(seconds, materials, strict=True):
        if span is None or material.machine_per_h is None:
            return None
        low, high = as_span(material.machine_per_h)
        cost = low * span[0] / _HOUR_S, high * span[1] / _HOUR_S
        prices.append(priced(cost, material.currency))
    return sum_prices(prices)


def sum_prices(prices: Iterable[Price | None]) -> Price | None:
    """Return the sum of prices; None where one is not known, or of two currencies.

    What costs nothing has any currency.

    Examples
    --------
    >>> euros, dollars = priced((1.0, 2.0), "EUR"), priced((1.0, 2.0), "USD")
    >>> price_text(sum_prices([euros, euros, priced((0.0, 0.0), "")]))
    '2.00 to 4.00 EUR'
    >>> sum_prices([euros, dollars]), sum_prices([euros, None])
    (None, None)
    """
    each = list(prices)
    known = [price for price in each if price is not None]
    currencies = {price.currency for price in known if price.high > 0.0}
    if len(known) < len(each) or len(currencies) > 1:
        return None
    sums = sum(price.low for price in known), sum(price.high for price in known)
    return priced(sums, currencies.pop() if currencies else (known[0].currency if known else ""))
