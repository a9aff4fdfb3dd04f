"""From what the engine finds to a posterior over all explanations, and the rule that turns it into answers."""
