typedef int placeholder_beam_element;
