typedef int placeholder_tube_vessel;
