// What PANELGATE_TEST_PCH compiles once has to belong to a target; it has nothing else.
