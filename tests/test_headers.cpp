// Translation unit of the precompiled headers of the tests
