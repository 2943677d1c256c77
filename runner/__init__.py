"""What ./nfm does once it has an interpreter: prepare the environment, run a verb.

Standard library only, and nothing here is part of the extension.
"""
