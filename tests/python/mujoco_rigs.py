"""Campaigns whose rigs another engine moves: MuJoCo's bodies, joints, tendons, actuators and air.

    python mujoco_rigs.py OUT        # writes OUT/NAME/campaign.toml with its recordings, and tells the truth as JSON

Nothing of thud takes part. A contact is a tendon that pushes where it is shorter than its dead band; springs are joints; what a robot's
drives do is an actuator; air is the medium's density. The measuring chain is white noise, an offset and nothing else.
"""

import json
import sys
from pathlib import Path

import mujoco
import numpy as np

STEP_S = 1e-5
RATE_HZ = 10_000
QUIET_S, AFTER_S = 0.06, 0.1
NOISE_N = 0.15
BODY_N_PER_M, PAD_N_PER_M = 25e3, 80e3
REACH_M = 0.1  # from the robot's tip to what it touches
MASSES_KG = (4.0, 7.0, 11.0)
SPEEDS_M_PER_S = (0.12, 0.2, 0.3, 0.4)
# What the experimenter knows of each: the true values are drawn about the stated ones.
BODY_SD, PAD_SD, MASS_SD, SPEED_SD, REPEATABILITY = 0.02, 0.1, 0.02, 0.01, 0.002


def slide(name, mass, attributes="", inside="", at=0.0):
    return (
        f'<body name="{name}" pos="{at} 0 0"><joint name="{name}" type="slide" axis="1 0 0" {attributes}/>'
        f'<inertial pos="0 0 0" mass="{mass}" diaginertia="1 1 1"/><site name="{name}"/>{inside}</body>'
    )


def scene(bodies, contact_n_per_m, touched="wall", actuators="", gravity=0.0):
    """Bodies of which `robot` presses on the site `touched` as soon as it comes nearer than REACH_M."""
    xml = f"""<mujoco><option timestep="{STEP_S}" gravity="{gravity} 0 0" integrator="RK4"/>
      <worldbody>{bodies}<site name="wall" pos="{REACH_M} 0 0"/></worldbody>
      <tendon><spatial name="contact" stiffness="{contact_n_per_m}" springlength="{REACH_M} 1000">
        <site site="robot"/><site site="{touched}"/></spatial></tendon>
      <actuator>{actuators}</actuator></mujoco>"""
    return mujoco.MjModel.from_xml_string(xml)


def pressed(model, data):
    """Force in the contact, N."""
    return model.tendon_stiffness[0] * max(0.0, REACH_M - data.ten_length[0])


def moved(model, speed, until_s, felt, moving=("robot",), control=None):
    """What the cell feels at every step from first contact on, N."""
    data = mujoco.MjData(model)
    for name in moving:
        data.joint(name).qvel[0] = speed
    mujoco.mj_forward(model, data)
    forces = np.empty(round(until_s / STEP_S) + 2)
    for step in range(len(forces)):
        forces[step] = felt(model, data)
        if control is not None:
            data.ctrl[0] = control(data)
        mujoco.mj_step(model, data)
    return forces


def plain(body, pad, mass, speed, until_s):
    return moved(scene(slide("robot", mass), in_series(body, pad)), speed, until_s, pressed)


def dropped(body, pad, mass, speed, until_s):
    return moved(scene(slide("robot", mass), in_series(body, pad), gravity=9.81), speed, until_s, pressed)


PIECE_KG, PIECE_DAMPING = 0.08, 4.0


def heavy_piece(body, pad, mass, speed, until_s):
    piece = slide("piece", PIECE_KG, f'stiffness="{body}" damping="{PIECE_DAMPING}"', at=REACH_M)
    model = scene(slide("robot", mass) + piece, pad, touched="piece")
    return moved(model, speed, until_s, lambda model, data: body * data.joint("piece").qpos[0])


LINK_FRACTION, JOINT_HZ, JOINT_DAMPING = 0.3, 15.0, 0.05


def elastic_joint(body, pad, mass, speed, until_s):
    link, tip = LINK_FRACTION * mass, (1 - LINK_FRACTION) * mass
    reduced, pulsation = link * tip / mass, 2 * np.pi * JOINT_HZ
    joint = f'stiffness="{reduced * pulsation**2}" damping="{2 * JOINT_DAMPING * reduced * pulsation}"'
    model = scene(slide("robot", tip, inside=slide("link", link, joint)), in_series(body, pad))
    return moved(model, speed, until_s, pressed)


COMPLIANCE_M_PER_N, FRAME_KG, FRAME_DAMPING = 4e-7, 15.0, 0.04


def soft_frame(body, pad, mass, speed, until_s):
    stiffness = 1 / COMPLIANCE_M_PER_N
    joint = f'stiffness="{stiffness}" damping="{2 * FRAME_DAMPING * np.sqrt(stiffness * FRAME_KG)}"'
    frame = slide("frame", FRAME_KG, joint, at=REACH_M)
    return moved(scene(slide("robot", mass) + frame, in_series(body, pad), touched="frame"), speed, until_s, pressed)


PUSH_N = 12.0


def pushing(body, pad, mass, speed, until_s):
    model = scene(slide("robot", mass), in_series(body, pad), actuators='<motor joint="robot" gear="1"/>')
    return moved(model, speed, until_s, pressed, control=lambda data: PUSH_N)


def in_series(body, pad):
    return 1 / (1 / body + 1 / pad)


# Name: what moves it, kind of rig, the mechanism that the baseline has not, and its parameters as the engine was told them.
CASES = {
    "plain": (plain, "impact", None, {}),
    "dropped": (dropped, "drop", None, {}),
    "piece": (heavy_piece, "impact", "moving-piece-inertia", {"mass_kg": PIECE_KG}),
    "joint": (elastic_joint, "impact", "joint-elasticity", {"link_fraction": LINK_FRACTION, "frequency_Hz": JOINT_HZ}),
    "frame": (soft_frame, "impact", "frame-compliance", {"compliance_m_per_N": COMPLIANCE_M_PER_N}),
    "push": (pushing, "impact", "robot-push", {"force_N": PUSH_N}),
}


def estimate(value, sd):
    return f"{{ value = {value:.6g}, sd = {sd:.3g} }}"


def campaign(folder, name, seed):
    strike, kind, _, _ = CASES[name]
    draw = np.random.default_rng(seed)
    body, pad = BODY_N_PER_M * (1 + BODY_SD * draw.normal()), PAD_N_PER_M * (1 + PAD_SD * draw.normal())
    text = [
        'format = "thud-campaign/1"', f'name = "{name}, by MuJoCo"', "[rig]", f'kind = "{kind}"',
        f"body_stiffness_N_per_m = {estimate(BODY_N_PER_M, BODY_SD * BODY_N_PER_M)}",
        f"pad_stiffness_N_per_m = {estimate(PAD_N_PER_M, PAD_SD * PAD_N_PER_M)}",
    ]
    text += ["gravity_along_impact_m_per_s2 = 9.81"] if kind == "drop" else []
    text += ["[chain]", f"sample_rate_Hz = {RATE_HZ}.0", f"noise_rms_N = {NOISE_N}", "full_scale_N = 1000.0", 'observed = "force_N"']
    number = 0
    for configuration, stated_kg in enumerate(MASSES_KG):
        mass = stated_kg * (1 + MASS_SD * draw.normal())
        for stated in SPEEDS_M_PER_S:
            number += 1
            speed = stated * (1 + SPEED_SD * draw.normal())
            repeated = body * (1 + REPEATABILITY * draw.normal())
            contact_s = QUIET_S + draw.uniform(0, 1e-3)
            until_s = np.pi * np.sqrt(mass / in_series(body, pad)) + AFTER_S
            times = np.arange(round((contact_s + until_s) * RATE_HZ)) / RATE_HZ
            forces = strike(repeated, pad, mass, speed, until_s + 1e-3)
            since = times - contact_s
            felt = np.interp(since, STEP_S * np.arange(len(forces)), forces, left=0.0)
            felt += NOISE_N * draw.normal(size=len(times)) + 0.1 * draw.normal()
            file = f"recordings/{number:03d}.csv"
            path = folder / file
            path.parent.mkdir(parents=True, exist_ok=True)
            np.savetxt(path, np.column_stack([times, felt]), "%.6f", ",", header="time_s,force_N", comments="")
            text += [
                "[[recording]]", f'file = "{file}"', f"impact_speed_m_per_s = {estimate(stated, SPEED_SD * stated)}",
                f"effective_mass_kg = {estimate(stated_kg, MASS_SD * stated_kg)}", f'configuration = "{configuration + 1}"',
            ]
    (folder / "campaign.toml").write_text("\n".join(text) + "\n", encoding="utf-8")


BALL_KG, BALL_M, AIR_KG_PER_M3, AIR_PA_S = 0.03, 0.12, 1.204, 1.8e-5


def fall(folder, name, seed):
    """A ball that falls through the medium; as a force of the speed's square the engine's own drag is told from its acceleration."""
    draw = np.random.default_rng(seed)
    inertia = 0.4 * BALL_KG * BALL_M**2
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="1e-4" gravity="0 0 -9.81" density="{AIR_KG_PER_M3}" viscosity="{AIR_PA_S}" integrator="RK4"/>
        <worldbody><body pos="0 0 3"><joint name="ball" type="slide" axis="0 0 1"/>
        <inertial pos="0 0 0" mass="{BALL_KG}" diaginertia="{inertia} {inertia} {inertia}"/></body></worldbody></mujoco>"""
    )
    text = [
        'format = "thud-campaign/1"', f'name = "{name}, by MuJoCo"', "[rig]", 'kind = "fall"', "gravity_along_impact_m_per_s2 = 9.81",
        "[chain]", "sample_rate_Hz = 1000.0", "noise_rms_N = 0.001", "full_scale_N = 5.0", 'observed = "height_m"',
    ]
    data = mujoco.MjData(model)
    data.joint("ball").qvel[0] = -3.0
    mujoco.mj_forward(model, data)
    coefficient = (data.qacc[0] + 9.81) * BALL_KG / 9.0
    for number in range(1, 7):
        data = mujoco.MjData(model)
        data.joint("ball").qvel[0] = -abs(draw.normal()) * 0.02
        heights = []
        while data.time < 0.7:
            heights.append(3.0 + data.joint("ball").qpos[0])
            for _ in range(10):
                mujoco.mj_step(model, data)
        heights = np.array(heights) + 0.001 * draw.normal(size=len(heights))
        file = f"recordings/{number:03d}.csv"
        (folder / "recordings").mkdir(parents=True, exist_ok=True)
        np.savetxt(
            folder / file, np.column_stack([np.arange(len(heights)) / 1000, heights]), "%.6f", ",", header="time_s,height_m", comments=""
        )
        text += [
            "[[recording]]", f'file = "{file}"', f"impact_speed_m_per_s = {estimate(0.0, 0.03)}",
            f"effective_mass_kg = {estimate(BALL_KG, 0.0003)}", 'configuration = "1"',
        ]
    (folder / "campaign.toml").write_text("\n".join(text) + "\n", encoding="utf-8")
    return {"coefficient_kg_per_m": coefficient}


def main():
    out = Path(sys.argv[1])
    truth = {}
    for seed, (name, (_, _, mechanism, parameters)) in enumerate(CASES.items()):
        campaign(out / name, name, seed)
        truth[name] = {"mechanism": mechanism, "parameters": parameters}
    truth["ball"] = {"mechanism": "air-drag", "parameters": fall(out / "ball", "ball", len(CASES))}
    print(json.dumps(truth))


if __name__ == "__main__":
    main()
