"""The paper, one documented formula a function: contacts, friction, compliance, task, force closure."""
