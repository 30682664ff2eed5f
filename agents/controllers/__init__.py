"""Controllers: their interface and files, the classical ones, learned policies, the shipped ones."""
