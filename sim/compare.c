typedef int placeholder_compare;
