"""The posterior over what a rig may have that its simulation lacks: models, evidence, decision."""
