"""What tests of the page compare models by."""


def rows_of(model):
    return [(active.effect.name, active.by_name) for active in model.effects]
