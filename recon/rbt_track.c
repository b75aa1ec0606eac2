typedef int placeholder_rbt_track;
