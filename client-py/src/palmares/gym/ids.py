"""Ids of the environments for `gymnasium.make`."""

import gymnasium

TASKS = {"Balls": "balls", "Shelf": "shelf", "Grasp": "grasp", "Pan": "pan", "Peg": "peg"}
HANDS = {
    "SoftHand": "softhand",
    "ReFlex": "reflex",
    "Pinch": "pinch",
    "YaleT42": "yale_t42",
    "YaleModelO": "yale_model_o",
    "RBO2": "rbo2",
    "Allegro": "allegro",
    "LEAP": "leap",
    "InspireRH56": "inspire_rh56",
    "BarrettBH282": "barrett_bh282",
    "Shadow": "shadow",
    "SoftHand2": "softhand2",
    "Robotiq3F": "robotiq_3f",
    "Robotiq2F85": "robotiq_2f85",
    "IHY": "ihy",
}


def names() -> dict[str, dict[str, str]]:
    """Return the ids, ``palmares/Balls-SoftHand-v1`` and so on, each with its task and hand."""
    return {
        f"palmares/{task_word}-{hand_word}-v1": {"task": task, "hand": hand}
        for task_word, task in TASKS.items()
        for hand_word, hand in HANDS.items()
    }


def register() -> None:
    """Register an id for each task and hand."""
    for name, kind in names().items():
        if name not in gymnasium.registry:
            gymnasium.register(
                id=name,
                entry_point="palmares.gym:FlatEnv",
                vector_entry_point="palmares.gym:BatchEnv",
                kwargs=kind,
            )
