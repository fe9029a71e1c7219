"""Names under which `gymnasium.make` finds the tasks."""

import gymnasium

TASKS = {"Balls": "balls", "Shelf": "shelf", "Grasp": "grasp", "Pan": "pan", "Peg": "peg"}
HANDS = {"SoftHand": "softhand", "ReFlex": "reflex", "Pinch": "pinch"}


def register() -> None:
    """Register ``palmares/Balls-SoftHand-v1`` and so on, one id for each task and hand."""
    for task_word, task in TASKS.items():
        for hand_word, hand in HANDS.items():
            name = f"palmares/{task_word}-{hand_word}-v1"
            if name not in gymnasium.registry:
                gymnasium.register(
                    id=name,
                    entry_point="palmares.gym:FlatEnv",
                    vector_entry_point="palmares.gym:BatchEnv",
                    kwargs={"task": task, "hand": hand},
                )
