"""Parts of the folder that ``palmares new`` makes: the controllers by task, a test and a README."""
