"""Misfire of the coupled six against the frequency domain; figures of docs/misfire.md."""

import pytest
from benchmarks.misfire import ORDERS, figures

import cranktrain as ct


@pytest.mark.slow
def test_orders_rise_as_the_frequency_domain_says(tmp_path):
    """Within 7 %: order by order where the misfire adds most, all orders by the balance."""
    fmus = ct.build_fmu("diesel_i6", tmp_path, film_table=False, block=False), ct.build_fmu("combustion_i6", tmp_path)
    found = figures(fmus, 2000.0)
    misfire, normal = found["misfire"], found["normal"]
    for k, order in enumerate(ORDERS):
        if order <= 2.0:
            assert abs(misfire["linear_off"][k]) < 0.07
        for run in (misfire, normal):
            assert abs(run["balance_off"][k]) < 2e-3
    assert misfire["coupled_mdeg"][0] > 30.0 * normal["coupled_mdeg"][0]
