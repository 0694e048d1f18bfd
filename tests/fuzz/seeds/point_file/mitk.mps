<?xml version="1.0" encoding="UTF-8"?>
<point_set_file><file_version>0.1</file_version><point_set><time_series><time_series_id>0</time_series_id>
<point><id>0</id><specification>0</specification><x>1.5</x><y>2</y><z>3</z></point>
<point><id>1</id><specification>0</specification><x>4</x><y>5</y><z>6</z></point>
</time_series></point_set></point_set_file>
