"""A body's heading is the direction between two sites: stretches keep away from where these nearly coincide."""

import numpy as np
import pytest

from bns.diagnose.data.bodies.joints import joint_tracks
from bns.diagnose.data.bodies.stretches import stretches_of_joints
from bns.physics.jointed.mechanism import Mechanism
from tests.jointed.arm import JOINTS, log, xml

ARM = Mechanism(xml(), ("elbow", "hand"))


def drawn_together(table, trial, from_s, to_s, share):
    """The hand at a share of its usual distance (the median) from the elbow, from one time to another of a trial."""
    table = table.copy()
    away = table[["hand_x_m", "hand_y_m"]].to_numpy() - table[["elbow_x_m", "elbow_y_m"]].to_numpy()
    usual = np.median(np.hypot(*away.T))
    there = ((table.trial == trial) & (table.t_s >= from_s) & (table.t_s < to_s)).to_numpy()
    unit = away / np.hypot(*away.T)[:, None]
    for k, axis in enumerate("xy"):
        table.loc[there, f"hand_{axis}_m"] = (table[f"elbow_{axis}_m"] + share * usual * unit[:, k])[there]
    return table


def of(table):
    return stretches_of_joints(joint_tracks(table)[0], ARM, JOINTS)


@pytest.mark.parametrize(("share", "begins_s"), [(0.45, 2.2), (0.55, 2.0)])
def test_a_stretch_begins_where_its_sites_are_well_apart(share, begins_s):
    told = of(drawn_together(log(4, noise_m=0.0), 1, 2.0, 2.18, share)).told
    assert told[len(told) // 4].from_s == pytest.approx(begins_s)


@pytest.mark.parametrize(("share", "left_out"), [(0.22, 3), (0.28, 0)])
def test_poses_where_they_nearly_coincide_are_left_out(share, left_out):
    usual = log(4, noise_m=0.0)
    there, before = of(drawn_together(usual, 1, 3.0, 3.11, share)), of(usual)
    assert len(there.told) == len(before.told)
    assert len(before.t_s) - len(there.t_s) == left_out
    gone = sorted(set(zip(before.trial, before.t_s, strict=True)) - set(zip(there.trial, there.t_s, strict=True)))
    assert [(trial, round(t_s, 2)) for trial, t_s in gone] == [(1, 3.0), (1, 3.04), (1, 3.08)][:left_out]


def test_a_stretch_that_is_nowhere_clear_is_none():
    usual = log(4, noise_m=0.0)
    assert len(of(drawn_together(usual, 1, 1.9, 4.0, 0.4)).told) == len(of(usual).told) - 1


def test_a_single_site_has_no_distance():
    table = log(3).drop(columns=["elbow_x_m", "elbow_y_m"])
    tracks = joint_tracks(table)[0]
    assert len(stretches_of_joints(tracks, Mechanism(xml(), ("hand",)), JOINTS).told) == 6
