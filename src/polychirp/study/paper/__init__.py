"""The paper's scenarios, their results and their statistics."""
